//! `spts dataset shapes`: procedural shapes as a picture.

use crate::context::Common;
use crate::error::CliError;
use crate::options::{seed, whole};
use clap::Args;
use serde::Serialize;
use spts::output::check_writable;
use spts_contact::shapes::{SHAPE_FAMILIES, Shape, ShapeFamily};
use spts_report::dataset::{drawn_shapes, save_shapes};
use std::path::PathBuf;

/// Most shapes of a picture, which is then some 12,000 pixels high.
const MOST_SHAPES: usize = 400;

/// Draws procedural shapes of every family, each seen from below, all to one scale.
///
/// Sizes, reliefs and edges have the default ranges. A data set of the same families draws numbers of its own.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts dataset shapes
  spts dataset shapes --families letter,gear --count 48 --seed 7 --out letters.png")]
pub(super) struct ShapesCommand {
    /// Families [default: all]
    #[arg(long, value_delimiter = ',', value_name = "NAME,…")]
    families: Vec<String>,
    /// Number of the first shape of every family
    #[arg(long, value_name = "SEED", default_value_t = 0, value_parser = seed)]
    seed: u64,
    /// Number of shapes, spread evenly over the families; [1, 400]
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = whole::<usize>(1..=MOST_SHAPES))]
    count: usize,
    /// Picture to write
    #[arg(long, value_name = "FILE.png", default_value = "shapes.png")]
    out: PathBuf,
    #[command(flatten)]
    common: Common,
}

/// What the command prints as JSON.
#[derive(Debug, Serialize)]
struct Report {
    file: PathBuf,
    shapes: Vec<ShapeLine>,
}

/// A shape that is shown.
#[derive(Debug, Serialize)]
struct ShapeLine {
    family: &'static str,
    number: u64,
    size_m: [f64; 2],
    relief_m: f64,
    edge_m: f64,
    dome_m: f64,
    area_m2: f64,
    holes: u32,
}

impl ShapeLine {
    fn of(shape: &Shape) -> Self {
        Self {
            family: shape.family,
            number: shape.seed,
            size_m: shape.size_m,
            relief_m: shape.relief_m,
            edge_m: shape.edge_m,
            dome_m: shape.dome_m,
            area_m2: shape.area_m2,
            holes: shape.holes,
        }
    }
}

impl ShapesCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let families = self.chosen()?;
        check_writable(&self.out)?;
        let shapes = drawn_shapes(&families, self.seed, self.count).map_err(|e| CliError::usage(e.to_string()))?;
        save_shapes(&shapes, &self.out)?;
        let report = Report {
            file: self.out,
            shapes: shapes.iter().map(ShapeLine::of).collect(),
        };
        self.common.print(&report, || {
            format!("{} shapes drawn: {}", report.shapes.len(), report.file.display())
        })
    }

    /// The named families in the order of their table, each once; all without a name.
    fn chosen(&self) -> Result<Vec<&'static ShapeFamily>, CliError> {
        let known = |name: &String| SHAPE_FAMILIES.iter().any(|family| family.name == name);
        if let Some(unknown) = self.families.iter().find(|name| !known(name)) {
            let names: Vec<&str> = SHAPE_FAMILIES.iter().map(|family| family.name).collect();
            return Err(CliError::usage(format!(
                "`--families` = {unknown}: valid: {}",
                names.join(", ")
            )));
        }
        let wanted =
            |family: &&ShapeFamily| self.families.is_empty() || self.families.iter().any(|name| name == family.name);
        Ok(SHAPE_FAMILIES.iter().filter(wanted).collect())
    }
}
