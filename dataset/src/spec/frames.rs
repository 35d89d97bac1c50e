//! Frames of any skin as the presses of a data set.

use super::config::{ObjectConfig, PoseConfig, PressConfig, RecordKind, SpecConfig};
use super::objects::SpecError;
use sha2::{Digest as _, Sha256};
use spts::data::{Courses, FrameLaw, SessionSet};
use spts::session::Event;
use spts::{Chain, Refusal};
use spts_models::SkinLayout;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use toml::{Table, Value};

/// Sessions of frames, press by press.
#[derive(Debug, Clone)]
pub(crate) struct FrameSource {
    layout: SkinLayout,
    sessions: Vec<(Arc<str>, Arc<Courses>)>,
    /// Whether the specification says how many rows there are.
    pub(super) rows_given: bool,
    pub(super) notes: Vec<String>,
}

/// One press of frames.
#[derive(Debug, Clone)]
pub(crate) struct FramePress {
    pub(crate) courses: Arc<Courses>,
    /// Number of the press in `courses`.
    pub(crate) press: usize,
}

impl FrameSource {
    /// The sessions that the specification `table` names by `object.from` = "frames"; `None` for another source.
    /// `folder` is the one that paths are relative to.
    pub(super) fn open(table: &Table, folder: &Path) -> Result<Option<Self>, SpecError> {
        let object = table.get("object").and_then(Value::as_table);
        if object.and_then(|object| object.get("from")).and_then(Value::as_str) != Some("frames") {
            return Ok(None);
        }
        let Some(named) = object.and_then(|object| object.get("folder")).and_then(Value::as_str) else {
            return Err(Refusal::new("`object.folder` is needed with `object.from` = \"frames\"").into());
        };
        let path = folder.join(named);
        let failed = |refusal: Refusal| SpecError::Folder(refusal.at(format!("`object.folder`: {}", path.display())));
        let set = SessionSet::open(&path).map_err(failed)?;
        let mut notes: Vec<String> = set.note.into_iter().collect();
        let (mut sessions, mut layout) = (Vec::new(), None);
        for session in &set.sessions {
            let Some(own) = session.raster().filter(|_| session.event == Event::Press).map(|r| *r.layout()) else {
                notes.push(format!("session {:?} has no frames of presses: it is left out", session.name));
                continue;
            };
            if layout.replace(own).is_some_and(|layout| layout != own) {
                return Err(failed(Refusal::new("the sessions are of different skins")));
            }
            let courses = Courses::of(session).map_err(|e| failed(e.at(&session.name)))?;
            notes.extend(courses.notes.iter().map(|note| format!("{}: {note}", session.name)));
            sessions.push((Arc::from(session.object.as_str()), Arc::new(courses)));
        }
        let layout = layout.ok_or_else(|| failed(Refusal::new("no session has frames of presses")))?;
        if sessions.windows(2).any(|pair| pair[0].1.unit() != pair[1].1.unit()) {
            return Err(failed(Refusal::new("the sessions are in different units")));
        }
        Ok(Some(Self { layout, sessions, rows_given: table.contains_key("rows"), notes }))
    }

    /// Whether the frames are pressures.
    pub(crate) fn are_pressures(&self) -> bool {
        self.sessions.iter().all(|(_, courses)| courses.are_pressures())
    }

    /// Writes what the frames say of the skin into `table`, where it says nothing: its layout, and which truths there
    /// are.
    pub(super) fn fill(&self, table: &mut Table) {
        let side = |count: usize| Value::Integer(i64::try_from(count).unwrap_or(i64::MAX));
        let skin = [
            ("rows", side(self.layout.rows())),
            ("cols", side(self.layout.cols())),
            ("pitch_m", Value::Float(self.layout.pitch_m())),
            ("electrode_m", Value::Float(self.layout.electrode_m())),
        ];
        let of_skin = table.entry("skin").or_insert_with(|| Value::Table(Table::new()));
        if let Value::Table(given) = of_skin {
            for (key, value) in skin {
                given.entry(key).or_insert(value);
            }
        }
        let record = table.entry("record").or_insert_with(|| Value::Table(Table::new()));
        if let (Value::Table(given), false) = (record, self.are_pressures()) {
            let known = ["conductance", "support"].map(Value::from).to_vec();
            given.entry("labels").or_insert(Value::Array(known));
        }
    }

    /// The presses of the objects called `names`, or of all: the first of every session, then the second, and so on.
    pub(super) fn presses(&self, names: Option<&[String]>) -> Result<Vec<(Arc<str>, FramePress)>, Refusal> {
        for name in names.into_iter().flatten() {
            if !self.sessions.iter().any(|(object, _)| **object == **name) {
                let known: BTreeSet<&str> = self.sessions.iter().map(|(object, _)| &**object).collect();
                let known = known.into_iter().collect::<Vec<_>>().join(", ");
                return Err(Refusal::new(format!("`object.names` = {name:?}; known: {known}")));
            }
        }
        let wanted = |object: &str| names.is_none_or(|names| names.iter().any(|name| name == object));
        let mut presses = Vec::new();
        let most = self.sessions.iter().map(|(_, courses)| courses.shape()[0]).max().unwrap_or(0);
        for press in 0..most {
            for (object, courses) in self.sessions.iter().filter(|(object, _)| wanted(object)) {
                if press < courses.shape()[0] {
                    presses.push((Arc::clone(object), FramePress { courses: Arc::clone(courses), press }));
                }
            }
        }
        if presses.is_empty() {
            return Err(Refusal::new("`object.names` = []: at least one name is needed"));
        }
        Ok(presses)
    }

    /// How the values become conductances on the skin of `chain`; one for all sessions.
    ///
    /// # Errors
    /// As for [`Courses::law`].
    pub(super) fn law(&self, chain: &Chain, peak_pa: f64) -> Result<(FrameLaw, Option<String>), Refusal> {
        let largest = self.sessions.iter().map(|(_, courses)| courses.largest()).fold(0.0, f64::max);
        let named = |refusal: Refusal| Refusal::new(refusal.to_string().replace("--peak", "object.peak_pa"));
        let (_, courses) = &self.sessions[0];
        let (law, said) = courses.law(chain, (peak_pa, Some(largest))).map_err(named)?;
        Ok((law, said.map(|said| said.replace("--peak", "object.peak_pa"))))
    }

    /// Refuses what frames have not: a pose, a force, a contact model, several objects, a drop.
    pub(super) fn check(&self, config: &SpecConfig) -> Result<(), Refusal> {
        let object = ObjectConfig::default();
        for (field, is_given) in [
            ("[pose]", config.pose != PoseConfig::default()),
            ("[press]", config.press != PressConfig::default()),
            ("[contact]", !config.contact.is_empty()),
            ("object.count", config.object.count != object.count),
        ] {
            if is_given {
                return Err(Refusal::new(format!(
                    "`{field}` is not for `object.from` = \"frames\", which are as they are"
                )));
            }
        }
        if config.drop.is_some() || config.record.what == RecordKind::Drop {
            return Err(Refusal::new("`record.what` = \"drop\" is for a ball; valid for frames: \"hold\", \"course\""));
        }
        let s = &config.skin;
        let own = &self.layout;
        if [s.rows, s.cols] != [own.rows(), own.cols()] {
            let (rows, cols) = (own.rows(), own.cols());
            return Err(Refusal::new(format!(
                "`skin` = {} × {} taxels; the frames have {rows} × {cols}: leave it out",
                s.rows, s.cols
            )));
        }
        if !self.are_pressures() && config.record.labels.contains(&super::Label::Pressure) {
            return Err(Refusal::new(
                "`record.labels` has \"pressure\", which is not known of these frames; valid: \"conductance\", \"support\"",
            ));
        }
        Ok(())
    }

    /// How long the hold is, and how long the frames go on after the touch, s; the shortest of all sessions.
    pub(super) fn lasts_s(&self) -> [f64; 2] {
        let of = |courses: &Courses| {
            [courses.hold().len() as f64 * courses.frame_s(), courses.since_touch_s(courses.shape()[1])]
        };
        let all = self.sessions.iter().map(|(_, courses)| of(courses));
        all.fold([f64::INFINITY; 2], |least, own| [least[0].min(own[0]), least[1].min(own[1])])
    }

    /// Adds all frames.
    pub(super) fn digest(&self, digest: &mut Sha256) {
        for (object, courses) in &self.sessions {
            digest.update(object.as_bytes());
            let hold = courses.hold();
            let facts = format!("{:?} {} {hold:?} {}", courses.unit(), courses.frame_s(), courses.touch());
            digest.update(facts.as_bytes());
            courses.values().iter().for_each(|v| digest.update(v.to_le_bytes()));
        }
    }
}
