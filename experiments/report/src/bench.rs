//! `spts bench` as text, files and figures: a card, and the leaderboard of several.

use super::write_all_or_none;
use crate::figures::{Curve, Plot, Style, save_charts};
use crate::html::{Page, PageFigure, PageTable, Section, html};
use spts::output::{OutputFolder, write_bytes, write_json};
use spts_eval::{Table, unique};
use spts_input::Refusal;
use spts_studies::bench::{Card, Entry, Interval, Ranked, Ranking, TASKS, TaskCard, Track};

/// A line of a card: a task with one number of measurements, and the time of its answers, µs.
type Line<'a> = (&'a TaskCard, &'a Entry, f64);

fn shown(interval: &Interval, digits: usize) -> String {
    let Interval { mean, low, high } = interval;
    format!("{mean:.digits$} ({low:.digits$} – {high:.digits$})")
}

/// A card in words.
pub fn text(card: &Card) -> String {
    let times = card.times_us.iter().copied().chain(std::iter::repeat(0.0));
    let tasks: Vec<(&TaskCard, f64)> = card.tasks.iter().zip(times).collect();
    let lines = tasks.iter().flat_map(|(task, time_us)| task.entries.iter().map(move |entry| (*task, entry, *time_us)));
    let table = Table::new("", lines)
        .shown("task", |(task, ..): Line<'_>| &task.task)
        .shown("M", |(_, entry, _)| entry.measurements)
        .shown("score (95 %)", |(_, entry, _)| shown(&entry.score, 2))
        .number("floor", 2, |(task, ..)| Some(task.floor))
        .number("ceiling", 2, |(task, ..)| Some(task.ceiling))
        .shown("points of the task", |(task, ..)| shown(&task.points, 0))
        .number("µs", 0, |(.., time_us)| Some(time_us).filter(|time_us| *time_us > 0.0));
    let mut out = table.text();
    for task in &card.tasks {
        if let Some((object, score)) = &task.worst {
            out.push_str(&format!("{}: least score {score:.2}, {object}\n", task.task));
        }
        if let Some(refused) = &task.refused {
            out.push_str(&format!("{}: not done, 0 points: {refused}\n", task.task));
        }
    }
    let how = if card.quick { ", few touches (--quick)" } else { "" };
    out.push_str(&format!(
        "{} on {}, track {}, {} split{how}: {} of 100 points\n",
        card.entrant,
        card.suite,
        card.track.name(),
        card.split,
        shown(&card.points, 1)
    ));
    out
}

/// Cards of one track, the best first.
fn ranked(cards: &[Card], track: Track) -> Vec<&Card> {
    let mut own: Vec<&Card> = cards.iter().filter(|card| card.track == track).collect();
    own.sort_by(|a, b| b.points.mean.total_cmp(&a.points.mean).then_with(|| a.entrant.cmp(&b.entrant)));
    own
}

fn points(card: &Card, task: &str) -> Option<f64> {
    card.tasks.iter().find(|own| own.task == task).map(|own| own.points.mean)
}

/// Tasks that a card has, in the order of the suite.
fn tasks(cards: &[&Card]) -> Vec<&'static str> {
    let there = |name: &&str| cards.iter().any(|card| points(card, name).is_some());
    TASKS.iter().map(|task| task.name).filter(there).collect()
}

fn leaderboard<'a>(cards: &[&'a Card]) -> Table<'a, &'a Card> {
    let table = Table::new("leaderboard", cards.iter().copied())
        .column("entrant", "entrant", |card: &Card| &card.entrant)
        .file("track", |card| card.track.name())
        .file("split", |card| &card.split)
        .file("quick", |card| card.quick)
        .file("points", |card| card.points.mean)
        .interval("points", |card| Some([card.points.low, card.points.high]))
        .shown("points (95 %)", |card| shown(&card.points, 1));
    let names = tasks(cards);
    names.into_iter().fold(table, |table, name| table.column(name, name, move |card| points(card, name)).digits(0))
}

/// The leaderboard of every track in words.
pub fn leaderboard_text(cards: &[Card]) -> String {
    let mut out = String::new();
    for track in Track::ALL {
        let own = ranked(cards, track);
        if !own.is_empty() {
            out.push_str(&format!("track {}\n\n{}\n", track.name(), leaderboard(&own).text()));
        }
    }
    out
}

fn ranking_table(ranking: &Ranking) -> Table<'_, &Ranked> {
    Table::new("ranking", &ranking.decoders)
        .column("entrant", "decoder", |d: &Ranked| &d.entrant)
        .column("iou", "IoU on recordings, left out", |d| d.iou)
        .digits(3)
        .file("worst_iou", |d| d.worst.1)
        .file("worst_object", |d| &d.worst.0)
        .shown("worst", |d| format!("{} {:.2}", d.worst.0, d.worst.1))
        .column("points", "points of small, thin, broad, middle", |d| d.points)
        .digits(1)
}

/// Two rankings in words.
pub fn ranking_text(ranking: &Ranking) -> String {
    let tau = shown(&ranking.tau, 2);
    format!("{}Kendall's τ of both rankings, interval over the objects: {tau}\n", ranking_table(ranking).text())
}

/// Writes `index.html`, `cards.json`, `tables/leaderboard.csv` and the figures into the folder `out`.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub fn write_leaderboard(cards: &[Card], ranking: Option<&Ranking>, out: OutputFolder) -> Result<(), Refusal> {
    write_all_or_none(out, |out| {
        let all: Vec<&Card> = Track::ALL.into_iter().flat_map(|track| ranked(cards, track)).collect();
        leaderboard(&all).write_csv(&out.folder("tables")?.join("leaderboard.csv"))?;
        write_json(&out.path("cards.json"), &cards)?;
        let figures = out.folder("figures")?;
        let mut sections = Vec::new();
        for track in Track::ALL {
            let own = ranked(cards, track);
            if own.is_empty() {
                continue;
            }
            save_charts(&charts(&own[..own.len().min(CURVES)]), &figures, track.name())?;
            let alt = format!("score over the number of measurements, task by task, track {}", track.name());
            let caption = "The six with most points, a panel a task; 95 % intervals over skins and touches.";
            sections.push(Section {
                id: track.name().to_owned(),
                title: format!("Track: {}", track.name()),
                lead: lead(track).to_owned(),
                figures: vec![PageFigure::new(track.name(), alt, caption)],
                tables: vec![PageTable::new("Points", &leaderboard(&own), "leaderboard")],
            });
        }
        if let Some(ranking) = ranking {
            let table = ranking_table(ranking);
            table.write_csv(&out.path("tables/ranking.csv"))?;
            sections.push(Section {
                id: "ranking".to_owned(),
                title: "Decoders on recordings of a real skin".to_owned(),
                lead: format!("Kendall's τ of both rankings: {}.", shown(&ranking.tau, 2)),
                tables: vec![PageTable::new("The best on the recordings first", &table, "ranking")],
                ..Section::default()
            });
        }
        let suites = unique(cards.iter().map(|card| card.suite.as_str())).join(", ");
        let page = Page {
            title: format!("Few-wire touch: {suites}"),
            summary:
                "100 points: as good as by all there is to measure; 0: as good as by nothing. A point of a task is a \
                      hundredth of the way between both, mean over the numbers of measurements."
                    .to_owned(),
            sections,
            ..Page::default()
        };
        write_bytes(&out.path("index.html"), html(&page).as_bytes())
    })
}

fn lead(track: Track) -> &'static str {
    match track {
        Track::Decoder => "Rows are given: the cells' own pseudorandom signs.",
        Track::Rows => "Rows of ±1 are the entrant's own, the same for every touch.",
        Track::Readout => "What is measured is the entrant's own.",
    }
}

/// Most entrants in a figure: more colours are not told apart.
const CURVES: usize = 6;

/// A panel for every task: scores over the number of measurements.
fn charts(cards: &[&Card]) -> Vec<crate::figures::Chart> {
    let rows = cards.iter().enumerate().flat_map(|(place, card)| {
        let tasks = card.tasks.iter();
        tasks.flat_map(move |task| task.entries.iter().map(move |entry| (place, *card, task, entry)))
    });
    let rows: Vec<(usize, &Card, &TaskCard, &Entry)> = rows.collect();
    let ink = |place: usize| u8::try_from(place).unwrap_or(u8::MAX);
    Plot::new(rows)
        .x("measurements", |(.., entry)| entry.measurements as f64)
        .log_x()
        .y("score", |(.., entry)| entry.score.mean)
        .within(0.0, 1.0)
        .band(|(.., entry)| Some((entry.score.low, entry.score.high)))
        .by(|(place, card, ..)| Curve::new(card.entrant.clone(), Style::Alternative, ink(place)))
        .facets(|(_, _, task, _)| task.task.clone())
}
