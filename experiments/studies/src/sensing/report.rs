//! What designed rows gain over random ones: bands over the repetitions, and how many random rows they are worth.

use super::classes::ClassRow;
use super::cost::CostRow;
use super::study::{KINDS, NamedScore, RANDOM, Repetition, SensingStudy};
use crate::touches::{Band, band};
use serde::Serialize;
use spts_recon::rows::Designer;
use std::collections::BTreeMap;

/// IoU and place error for one kind of touches with one designer and M.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SensingRow {
    /// Kind of touches: "shapes" or "objects".
    pub touches: &'static str,
    /// Readout profile.
    pub readout: String,
    /// Designer of the rows.
    pub designer: &'static str,
    /// Measurements M.
    pub m: usize,
    /// Intersection over union of the supports.
    pub iou: Band,
    /// IoU minus that with random rows in the same repetition.
    pub gain: Band,
    /// Mean distance of the centres, taxels.
    pub place_px: Option<Band>,
    /// Share of the samples at an end of the range.
    pub clipped: f64,
}

/// IoU of one object, or of one family of shapes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NamedRow {
    /// Kind of touches: "shapes" or "objects".
    pub touches: &'static str,
    /// Object, or family of the shapes.
    pub name: String,
    /// Readout profile.
    pub readout: String,
    /// Designer of the rows.
    pub designer: &'static str,
    /// Measurements M.
    pub m: usize,
    /// Number of touches.
    pub count: usize,
    /// Intersection over union of the supports, mean over the touches of all repetitions.
    pub iou: f64,
}

/// The number of random rows with the same IoU as one designer's rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Equal {
    /// Kind of touches: "shapes" or "objects".
    pub touches: &'static str,
    /// Readout profile.
    pub readout: String,
    /// Designer of the rows.
    pub designer: &'static str,
    /// Number of its measurements.
    pub m: usize,
    /// Number of measurements with random rows that gives the same IoU, interpolated; `None` if even the largest number
    /// does not.
    pub random_m: Option<f64>,
}

/// Results of `spts sensing study`: scores of designed and random rows, and what the rows cost.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SensingReport {
    /// Rows and columns of the skin.
    pub skin: [usize; 2],
    /// Decoder.
    pub decoder: &'static str,
    /// Number of repetitions.
    pub skins: usize,
    /// Number of touches in a repetition and kind.
    pub touches: usize,
    /// Scores.
    pub rows: Vec<SensingRow>,
    /// Equivalent numbers of random rows.
    pub equal: Vec<Equal>,
    /// Shares of the seventeen objects that are classified.
    pub classes: Vec<ClassRow>,
    /// Errors of the samples by cause, and sizes of the sums.
    pub costs: Vec<CostRow>,
    /// Scores of single objects and families.
    pub named: Vec<NamedRow>,
}

/// What a column of scores belongs to.
#[derive(Clone, Copy)]
struct Column<'a> {
    kind: usize,
    readout: &'a str,
    designer: &'static Designer,
    m: usize,
}

impl SensingReport {
    /// The report of `study` from its `repetitions`.
    pub(super) fn new(study: &SensingStudy, repetitions: &[Repetition], classes: Vec<ClassRow>) -> Self {
        let columns = columns(study);
        let iou_of = |k: usize| -> Vec<f64> {
            let mean =
                |scores: &Vec<NamedScore>| scores.iter().map(|(_, s)| s.iou).sum::<f64>() / scores.len().max(1) as f64;
            repetitions.iter().map(|r| mean(&r.scores[k])).collect()
        };
        let random = study.designers.iter().position(|d| d.name == RANDOM);
        let width = study.designers.len();
        let (mut rows, mut named) = (Vec::new(), Vec::new());
        for (k, column) in columns.iter().enumerate() {
            let (own, touches) = (iou_of(k), KINDS[column.kind].1);
            let of_random = random.map_or_else(|| own.clone(), |r| iou_of(k - k % width + r));
            let gains: Vec<f64> = own.iter().zip(&of_random).map(|(a, b)| a - b).collect();
            let places: Vec<f64> = repetitions.iter().filter_map(|r| mean_place(&r.scores[k])).collect();
            let (Some(iou), Some(gain)) = (band(&own), band(&gains)) else {
                continue;
            };
            rows.push(SensingRow {
                touches,
                readout: column.readout.to_owned(),
                designer: column.designer.name,
                m: column.m,
                iou,
                gain,
                place_px: band(&places),
                clipped: repetitions.iter().map(|r| r.clipped[k]).sum::<f64>() / repetitions.len() as f64,
            });
            let mut names: BTreeMap<&str, (usize, f64)> = BTreeMap::new();
            for (name, score) in repetitions.iter().flat_map(|r| &r.scores[k]) {
                let entry = names.entry(name).or_default();
                *entry = (entry.0 + 1, entry.1 + score.iou);
            }
            named.extend(names.into_iter().map(|(name, (count, sum))| NamedRow {
                touches,
                name: name.to_owned(),
                readout: column.readout.to_owned(),
                designer: column.designer.name,
                m: column.m,
                count,
                iou: sum / count as f64,
            }));
        }
        let costs: Vec<&[CostRow]> = repetitions.iter().map(|r| &r.costs[..]).collect();
        Self {
            skin: [study.layout.rows(), study.layout.cols()],
            decoder: study.decoder.name,
            skins: study.skins,
            touches: study.touches,
            equal: equals(&rows),
            rows,
            classes,
            costs: CostRow::mean(&costs),
            named,
        }
    }
}

/// All columns, in the order in which a repetition has them.
fn columns(study: &SensingStudy) -> Vec<Column<'_>> {
    let mut columns = Vec::new();
    for kind in 0..KINDS.len() {
        for readout in &study.readouts {
            for &m in &study.measurements {
                columns.extend(study.designers.iter().map(|&designer| Column {
                    kind,
                    readout,
                    designer,
                    m,
                }));
            }
        }
    }
    columns
}

/// Mean distance of the centres of all touches that have one.
fn mean_place(scores: &[NamedScore]) -> Option<f64> {
    let places: Vec<f64> = scores.iter().filter_map(|(_, s)| s.place_px).collect();
    (!places.is_empty()).then(|| places.iter().sum::<f64>() / places.len() as f64)
}

/// How many measurements with random rows each other row of the table is worth: where the random curve, a straight
/// line between the M that were tried, first has its IoU.
fn equals(rows: &[SensingRow]) -> Vec<Equal> {
    let alike = |a: &SensingRow, b: &SensingRow| a.touches == b.touches && a.readout == b.readout;
    let worth = |row: &SensingRow| {
        let mut curve: Vec<(f64, f64)> = rows
            .iter()
            .filter(|r| r.designer == RANDOM && alike(r, row))
            .map(|r| (r.m as f64, r.iou.mean))
            .collect();
        curve.sort_by(|a, b| a.0.total_cmp(&b.0));
        let first = curve
            .first()
            .filter(|first| first.1 >= row.iou.mean)
            .map(|first| first.0);
        let crossing = curve
            .windows(2)
            .find(|w| w[0].1 < row.iou.mean && w[1].1 >= row.iou.mean);
        first.or_else(|| {
            let [(m0, i0), (m1, i1)] = [*crossing?.first()?, *crossing?.last()?];
            Some(m0 + (m1 - m0) * (row.iou.mean - i0) / (i1 - i0))
        })
    };
    let others = rows.iter().filter(|row| row.designer != RANDOM);
    others
        .map(|row| Equal {
            touches: row.touches,
            readout: row.readout.clone(),
            designer: row.designer,
            m: row.m,
            random_m: worth(row),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: random has .2, .4, .8 at 5, 10, 20; .5 lies a quarter of the way from 10 to 20.
    #[test]
    fn what_a_row_is_worth_is_interpolated() {
        let row = |designer: &'static str, m: usize, iou: f64| SensingRow {
            touches: "shapes",
            readout: "ideal".to_owned(),
            designer,
            m,
            iou: band(&[iou]).unwrap(),
            gain: band(&[0.0]).unwrap(),
            place_px: None,
            clipped: 0.0,
        };
        let rows = [
            row("random", 20, 0.8),
            row("random", 5, 0.2),
            row("random", 10, 0.4),
            row("greedy", 5, 0.5),
            row("greedy", 10, 0.9),
            row("hadamard", 5, 0.1),
        ];
        let found: Vec<Option<f64>> = equals(&rows).iter().map(|e| e.random_m).collect();
        assert!((found[0].unwrap() - 12.5).abs() < 1e-12);
        assert_eq!((found[1], found[2]), (None, Some(5.0)));
    }
}
