//! `spts dataset preview`: rows of a data set as a picture.

use super::make::Files;
use crate::context::{Common, notes};
use crate::error::CliError;
use crate::options::{seed, whole};
use clap::Args;
use serde::Serialize;
use spts::Refusal;
use spts::output::check_replaceable;
use spts_contact::shapes::{SHAPE_FAMILIES, Shape, ShapeFamily};
use spts_dataset::{Dataset, Label, Spec, spread_rows};
use spts_report::dataset::{
    MOST_PREVIEW_ROWS, PREVIEW_COLUMNS, Preview, PreviewRow, drawn_shapes, save_preview, save_shapes,
};
use spts_report::figures::is_own_picture;
use std::path::{Path, PathBuf};

/// Draws rows of a data set: true pressure, raster image and samples of each.
///
/// Given a folder, the command draws rows of the files that are there; the data set need not be finished. Given a spec,
/// it makes the rows for the picture and writes nothing else. Every map has a colour scale of its own, and the picture
/// gives the ends of every scale. Colours of pressure follow its square root, so that light touches are seen as well as
/// firm ones.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts dataset preview out/shapes
  spts dataset preview random-shapes --out shapes.png      rows of a spec, before any data set is made
  spts dataset preview my_spec.toml --rows 60 --seed 1     60 rows chosen at random")]
pub(super) struct PreviewCommand {
    /// Folder of the data set; or a spec: a TOML file, or one of those that ship
    #[arg(value_name = "DIR|SPEC")]
    source: String,
    /// Number of rows to draw; [1, 150]
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = whole::<u64>(1..=MOST_PREVIEW_ROWS))]
    rows: u64,
    /// Seed with which the rows are chosen at random [default: rows spread evenly]
    #[arg(long, value_name = "SEED", value_parser = seed)]
    seed: Option<u64>,
    /// Picture to write [default: NAME-preview.png in the current folder]
    #[arg(long, value_name = "FILE.png")]
    out: Option<PathBuf>,
    #[command(flatten)]
    files: Files,
    #[command(flatten)]
    common: Common,
}

/// What the command prints as JSON.
#[derive(Debug, Serialize)]
struct Report {
    file: PathBuf,
    /// Numbers of the rows that are shown.
    rows: Vec<u64>,
}

/// Where rows come from.
enum Source {
    Files(Box<Dataset>),
    Spec(Box<Spec>),
}

impl Source {
    fn spec(&self) -> &Spec {
        match self {
            Self::Files(dataset) => dataset.spec(),
            Self::Spec(spec) => spec,
        }
    }
}

impl PreviewCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let folder = Path::new(&self.source);
        let source = if folder.is_dir() {
            Source::Files(Box::new(self.files.open(folder)?))
        } else {
            Source::Spec(Box::new(Spec::load(&self.source, &toml::Table::new())?))
        };
        let spec = source.spec();
        notes(spec.notes());
        if !spec.config().record.labels.contains(&Label::Pressure) {
            let source = &self.source;
            return Err(CliError::usage(format!(
                "{source}: has no pressures to draw: `record.labels` leaves them out"
            )));
        }
        let held = match &source {
            Source::Files(dataset) => dataset.made_rows(),
            Source::Spec(spec) => std::iter::once(0..spec.config().rows).collect(),
        };
        if held.is_empty() {
            let folder = folder.display();
            return Err(CliError::usage(format!(
                "{folder}: has no rows yet; run `spts dataset make` with this folder"
            )));
        }
        let wanted = match self.seed {
            Some(seed) => spec.drawn_rows("preview", &held, self.rows, seed),
            None => spread_rows(&held, self.rows),
        };
        let name = &spec.config().name;
        let file = self.out.unwrap_or_else(|| PathBuf::from(format!("{name}-preview.png")));
        check_replaceable(&file, is_own_picture)?;
        let mut rows = Vec::new();
        let size = (spec.skin().rows(), spec.skin().cols());
        let each = |row| -> Result<(), Refusal> {
            rows.push(PreviewRow::of(&row, size).map_err(|e| e.at(&self.source))?);
            Ok(())
        };
        match &source {
            Source::Files(dataset) => dataset.rows(&wanted, PREVIEW_COLUMNS, each)?,
            Source::Spec(spec) => spec.rows(&wanted, PREVIEW_COLUMNS, each)?,
        }
        let preview = Preview { name: name.clone(), of: spec.config().rows, rows };
        save_preview(&preview, &file)?;
        let report = Report { file, rows: wanted.into_iter().collect() };
        self.common.print(&report, || format!("{} rows drawn: {}", report.rows.len(), report.file.display()))
    }
}

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
struct ShapesReport {
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
        check_replaceable(&self.out, is_own_picture)?;
        let shapes = drawn_shapes(&families, self.seed, self.count)?;
        save_shapes(&shapes, &self.out)?;
        let report = ShapesReport { file: self.out, shapes: shapes.iter().map(ShapeLine::of).collect() };
        self.common.print(&report, || format!("{} shapes drawn: {}", report.shapes.len(), report.file.display()))
    }

    /// The named families in the order of their table, each once; all without a name.
    fn chosen(&self) -> Result<Vec<&'static ShapeFamily>, CliError> {
        let known = |name: &String| SHAPE_FAMILIES.iter().any(|family| family.name == name);
        if let Some(unknown) = self.families.iter().find(|name| !known(name)) {
            let names: Vec<&str> = SHAPE_FAMILIES.iter().map(|family| family.name).collect();
            return Err(CliError::usage(format!("`--families` = {unknown}: valid: {}", names.join(", "))));
        }
        let wanted =
            |family: &&ShapeFamily| self.families.is_empty() || self.families.iter().any(|name| name == family.name);
        Ok(SHAPE_FAMILIES.iter().filter(wanted).collect())
    }
}
