//! The last step of making a data set: checks everything and describes it, for people and for search programs.

use crate::columns::{Column, Kind, columns};
use crate::file::{Wanted, batches, check_shard, failed, numbers, refused, shard_name, version};
use crate::folder::{DATA_FOLDER, Dataset, HEAD_FILE, SPEC_FILE};
use crate::spec::{ObjectSource, Spec};
use arrow_array::Array as _;
use arrow_array::cast::AsArray as _;
use serde::Serialize;
use serde_json::{Value, json};
use spts::Refusal;
use spts::output::{Manifest, is_temporary, json_text, not_ours, remove_left, write_bytes};
use spts::progress::Progress;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs::DirEntry;
use std::path::{Path, PathBuf};

/// Files that describe a whole data set.
const STATISTICS_FILE: &str = "statistics.json";
const CARD_FILE: &str = "README.md";
const CROISSANT_FILE: &str = "croissant.json";

/// Summary of a complete data set: what `spts dataset finish` prints.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finished {
    /// Number of rows.
    pub rows: u64,
    /// Number of files with rows.
    pub shards: u64,
    /// Their size, bytes.
    pub bytes: u64,
    /// SHA-256 of the names and contents of all files with rows. It does not depend on where the data set was made. In
    /// its folder it is the SHA-256 of the output of `sha256sum data/*.parquet`.
    pub digest: String,
}

impl Dataset {
    /// Checks that all files exist and are complete, and writes statistics, card, `croissant.json` and, last,
    /// `manifest.json`.
    ///
    /// # Errors
    /// [`Refusal`] if a file is missing, damaged, or not part of this data set, or cannot be written.
    pub fn finish(&self, progress: &dyn Progress) -> Result<Finished, Refusal> {
        let spec = self.spec();
        for path in self.check_files(progress)? {
            remove_left(&path).map_err(failed(&path))?;
        }
        let names: Vec<String> = (0..spec.shards()).map(|k| shard_name(k, spec.shards())).collect();
        let data = self.folder().join(DATA_FOLDER);
        let statistics = Statistics::of(self, progress)?;
        let size = |name: &String| std::fs::metadata(data.join(name)).map(|m| m.len());
        let bytes = names.iter().map(size).sum::<Result<u64, _>>().map_err(failed(&data))?;
        let at = |name: &str| -> PathBuf { self.folder().join(name) };
        let described = [HEAD_FILE, SPEC_FILE, STATISTICS_FILE, CARD_FILE, CROISSANT_FILE].map(str::to_owned);
        let listed: Vec<String> = names.iter().map(|name| format!("{DATA_FOLDER}/{name}")).collect();
        let texts = [
            (STATISTICS_FILE, json_text(&at(STATISTICS_FILE), &statistics)?),
            (CARD_FILE, card(spec, &statistics, bytes)),
            (CROISSANT_FILE, json_text(&at(CROISSANT_FILE), &croissant(spec))?),
        ];
        for (name, text) in &texts {
            self.check_own(name, text)?;
        }
        for (name, text) in &texts {
            write_bytes(&at(name), text.as_bytes())?;
        }
        let manifest = Manifest::write_of(self.folder(), &[&described[..], &listed].concat(), &BTreeSet::new())?;
        Ok(Finished { rows: statistics.rows, shards: spec.shards(), bytes, digest: manifest.digest_of(DATA_FOLDER) })
    }

    /// Refuses to write `text` in place of a file `name` that no run has written, or that was changed since.
    fn check_own(&self, name: &str, text: &str) -> Result<(), Refusal> {
        let path = self.folder().join(name);
        let same = || spts_input::read(&path, text.len() as u64).is_ok_and(|found| found == text.as_bytes());
        let listed = |manifest: Manifest| manifest.is_unchanged(self.folder(), name).unwrap_or(false);
        match path.symlink_metadata() {
            Ok(_) if !same() && !Manifest::read(self.folder()).is_some_and(listed) => Err(not_ours(&path)),
            _ => Ok(()),
        }
    }

    /// Checks that all files are there, whole and of this data set, and that there are no others. Returns the files
    /// that runs which were ended have left behind.
    ///
    /// # Errors
    /// [`Refusal`] when a file is missing, damaged, of another data set, or of no data set.
    pub(crate) fn check_files(&self, progress: &dyn Progress) -> Result<Vec<PathBuf>, Refusal> {
        let spec = self.spec();
        let names: BTreeSet<String> = (0..spec.shards()).map(|k| shard_name(k, spec.shards())).collect();
        self.check_whole(0..spec.shards())?;
        progress.stage("files checked", usize::try_from(spec.shards()).ok());
        let mut missing = Vec::new();
        for shard in 0..spec.shards() {
            let path = self.shard_file(shard);
            if path.symlink_metadata().is_ok() {
                check_shard(spec, shard, &path)?;
            } else {
                missing.push(shard);
            }
            progress.step();
        }
        progress.end();
        if let Some(first) = missing.first() {
            let (count, all) = (missing.len(), spec.shards());
            let problem =
                format!("is missing, as {count} of {all} files are: run `spts dataset make` with this folder again");
            return Err(refused(self.shard_file(*first), problem));
        }
        let data = self.folder().join(DATA_FOLDER);
        for entry in entries(&data)? {
            let name = entry.file_name().to_string_lossy().into_owned();
            if !is_temporary(&name) && !names.contains(&name) {
                return Err(refused(entry.path(), "is not of this data set; move it away"));
            }
        }
        let all = [entries(self.folder())?, entries(&data)?].into_iter().flatten();
        let left = all.filter(|entry| is_temporary(&entry.file_name().to_string_lossy()));
        Ok(left.map(|entry| entry.path()).collect())
    }
}

/// What `folder` holds.
fn entries(folder: &Path) -> Result<Vec<DirEntry>, Refusal> {
    let entries = std::fs::read_dir(folder).and_then(Iterator::collect);
    entries.map_err(failed(folder))
}

/// Statistics of a data set, column by column in file order.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Statistics {
    /// Number of rows.
    pub rows: u64,
    /// Columns.
    pub columns: Vec<ColumnStatistics>,
}

/// Statistics of a column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ColumnStatistics {
    /// The column.
    #[serde(flatten)]
    pub column: Column,
    /// Number of values; for lists, the number of their entries.
    pub count: u64,
    /// Smallest value; `None` for texts, and without any value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least: Option<f64>,
    /// Mean; `None` for texts, and without any value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean: Option<f64>,
    /// Largest value; `None` for texts, and without any value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most: Option<f64>,
    /// Number of rows with each text.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub texts: BTreeMap<String, u64>,
}

impl Statistics {
    /// Computes the statistics of all files of `dataset`.
    ///
    /// # Errors
    /// [`Refusal`] if a file cannot be read, or holds a value that is not finite.
    pub fn of(dataset: &Dataset, progress: &dyn Progress) -> Result<Self, Refusal> {
        let spec = dataset.spec();
        let mut rows = 0;
        let mut sums = vec![0.0; columns(spec).len()];
        let of =
            |column| ColumnStatistics { column, count: 0, least: None, mean: None, most: None, texts: BTreeMap::new() };
        let mut all: Vec<ColumnStatistics> = columns(spec).into_iter().map(of).collect();
        progress.stage("statistics", usize::try_from(spec.shards()).ok());
        for shard in 0..spec.shards() {
            let path = dataset.shard_file(shard);
            batches(&path, Wanted::All, |batch| {
                rows += batch.num_rows() as u64;
                for ((found, sum), array) in all.iter_mut().zip(&mut sums).zip(batch.columns()) {
                    if found.column.kind == Kind::Text {
                        for text in array.as_string::<i32>().iter().flatten() {
                            *found.texts.entry(text.to_owned()).or_default() += 1;
                        }
                        found.count += (array.len() - array.null_count()) as u64;
                        continue;
                    }
                    let mut finite = true;
                    numbers(array, |value| {
                        finite &= value.is_finite();
                        *sum += value;
                        found.count += 1;
                        found.least = Some(found.least.map_or(value, |least| least.min(value)));
                        found.most = Some(found.most.map_or(value, |most| most.max(value)));
                    });
                    if !finite {
                        let problem = format!("column `{}` holds a value that is not finite", found.column.name);
                        return Err(refused(&path, problem));
                    }
                }
                Ok(true)
            })?;
            progress.step();
        }
        progress.end();
        for (found, sum) in all.iter_mut().zip(sums) {
            found.mean = found.least.map(|_| sum / found.count as f64);
        }
        Ok(Self { rows, columns: all })
    }

    /// The column called `name`.
    pub fn column(&self, name: &str) -> Option<&ColumnStatistics> {
        self.columns.iter().find(|c| c.column.name == name)
    }
}

/// Ranges of numbers of rows by which data sets are sorted.
const SIZES: [(u64, &str); 9] = [
    (1_000, "n<1K"),
    (10_000, "1K<n<10K"),
    (100_000, "10K<n<100K"),
    (1_000_000, "100K<n<1M"),
    (10_000_000, "1M<n<10M"),
    (100_000_000, "10M<n<100M"),
    (1_000_000_000, "100M<n<1B"),
    (10_000_000_000, "1B<n<10B"),
    (u64::MAX, "10B<n<100B"),
];

/// The card of a data set: a page with the head that Hugging Face reads.
pub(crate) fn card(spec: &Spec, statistics: &Statistics, bytes: u64) -> String {
    let config = spec.config();
    let size = SIZES.iter().find(|(most, _)| statistics.rows < *most).map_or("", |(_, size)| size);
    let skin = spec.skin();
    let contact = if spec.frame_law().is_some() { "as the frames have it" } else { spec.contact().0 };
    let objects = match config.object.from {
        ObjectSource::Shapes => "procedural shapes",
        ObjectSource::Objects => "the seventeen objects of the published recordings",
        ObjectSource::Meshes => "mesh files",
        ObjectSource::Ball => "a ball that falls",
        ObjectSource::Frames => "frames of a skin or simulator, press by press",
    };
    let mut text = format!(
        "---\nlicense: cc-by-4.0\npretty_name: {name}\nsize_categories:\n- {size}\ntags:\n- tactile\n- robotics\n- simulation\n- \
         compressed-sensing\nconfigs:\n- config_name: default\n  data_files: data/*.parquet\n---\n\n# {name}\n\n{description}\n\n\
         Touches of a single-pixel tactile skin, simulated: {rows} rows, {megabytes:.1} MB. Every row is one window of {m} measurements \
         of the skin's one wire, with the truth: pressure, conductance, pose and force.\n\n\
         ## How it was made\n\n\
         | | |\n|---|---|\n| skin | {taxel_rows} × {cols} taxels, pitch {pitch} mm |\n| objects | {objects} |\n| contact | {contact} |\n\
         | transducer and readout | {readout} |\n| program | spts {version} |\n| spec | `spec.toml`, SHA-256 {identity} |\n\n\
         Nothing in it was measured: contact, sheet and electronics are models, whose parameters were fitted to recordings of the real \
         skin. `spts dataset make spec.toml --out DIR` makes the same files again, bit for bit, on any machine of the same type; \
         `spts dataset verify` checks a sample of rows.\n\n",
        name = config.name,
        description = config.description,
        rows = statistics.rows,
        megabytes = bytes as f64 / 1e6,
        m = config.record.measurements,
        taxel_rows = skin.rows(),
        cols = skin.cols(),
        pitch = 1e3 * skin.pitch_m(),
        readout = config.readout,
        version = version(),
        identity = spec.identity(),
    );
    splits(&mut text, statistics);
    text.push_str(
        "## Columns\n\n| column | type | unit | least | mean | largest | what it is |\n|---|---|---|---|---|---|---|\n",
    );
    for found in &statistics.columns {
        let c = &found.column;
        let kind = c.type_name();
        let number = |value: Option<f64>| value.map_or_else(String::new, short);
        let (least, mean, most) = (number(found.least), number(found.mean), number(found.most));
        let _ =
            writeln!(text, "| `{}` | {kind} | {} | {least} | {mean} | {most} | {} |", c.name, c.unit, c.description);
    }
    text.push_str(
        "\nLists are row by row of the skin: entry r · columns + c is the taxel of row r, column c. `y` = Φ x + noise, where x is the image in \
         volts and the rows of Φ are the weights of the cells from row `first_row` on.\n\n\
         ## Datasheet\n\n\
         - **Motivation**: training and testing of decoders, classifiers and localisers for skins that are read through one wire.\n\
         - **Composition**: synthetic touches only; no people, no personal data. Splits never divide a shape or a press (see `spec.toml`).\n\
         - **Known gaps**: contact is quasi-static and without friction; an object that is bent round a corner of the skin is not modelled. \
         A model learned on it has to be checked on recordings.\n\
         - **Licence**: CC BY 4.0.\n",
    );
    text
}

/// The table of splits.
fn splits(text: &mut String, statistics: &Statistics) {
    text.push_str("## Splits\n\n| split | rows |\n|---|---|\n");
    for (split, rows) in statistics.column("split").into_iter().flat_map(|c| &c.texts) {
        let _ = writeln!(text, "| {split} | {rows} |");
    }
    text.push_str(
        "\nThe split of a row is in its column `split`. Hugging Face `datasets` reads all rows as one split; \
         `.filter(lambda row: row[\"split\"] == \"test\")` takes those of a split.\n\n",
    );
}

/// A number with about four digits.
fn short(value: f64) -> String {
    let size = value.abs();
    if size < 1e15 && value.fract().abs() < f64::MIN_POSITIVE {
        format!("{value:.0}")
    } else if (1e-2..1e5).contains(&size) {
        format!("{value:.3}")
    } else {
        format!("{value:.2e}")
    }
}

/// The description in the Croissant format, version 1.0
/// (<https://docs.mlcommons.org/croissant/docs/croissant-spec.html>).
pub(crate) fn croissant(spec: &Spec) -> Value {
    let config = spec.config();
    let fields: Vec<Value> = columns(spec)
        .into_iter()
        .map(|column| {
            let data_type = match column.kind {
                Kind::Text => "sc:Text",
                Kind::Bool => "sc:Boolean",
                Kind::I32 | Kind::I64 => "sc:Integer",
                Kind::F32 => "sc:Float",
            };
            let mut field = json!({
                "@type": "cr:Field",
                "@id": format!("rows/{}", column.name),
                "name": column.name,
                "description": column.description,
                "dataType": data_type,
                "source": {"fileSet": {"@id": "parquet-files"}, "extract": {"column": column.name}},
            });
            if column.length.is_some() {
                field["repeated"] = true.into();
            }
            field
        })
        .collect();
    json!({
        "@context": {
            "@language": "en", "@vocab": "https://schema.org/", "citeAs": "cr:citeAs", "column": "cr:column",
            "conformsTo": "dct:conformsTo", "cr": "http://mlcommons.org/croissant/", "data": {"@id": "cr:data", "@type": "@json"},
            "dataType": {"@id": "cr:dataType", "@type": "@vocab"}, "dct": "http://purl.org/dc/terms/",
            "equivalentProperty": "cr:equivalentProperty", "examples": {"@id": "cr:examples", "@type": "@json"},
            "extract": "cr:extract", "field": "cr:field", "fileObject": "cr:fileObject", "fileProperty": "cr:fileProperty",
            "fileSet": "cr:fileSet", "format": "cr:format", "includes": "cr:includes", "isLiveDataset": "cr:isLiveDataset",
            "jsonPath": "cr:jsonPath", "key": "cr:key", "md5": "cr:md5", "parentField": "cr:parentField", "path": "cr:path",
            "recordSet": "cr:recordSet", "rai": "http://mlcommons.org/croissant/RAI/", "references": "cr:references", "regex": "cr:regex", "repeated": "cr:repeated",
            "replace": "cr:replace", "samplingRate": "cr:samplingRate", "sc": "https://schema.org/", "separator": "cr:separator", "source": "cr:source",
            "subField": "cr:subField", "transform": "cr:transform",
        },
        "@type": "sc:Dataset",
        "name": config.name,
        "description": config.description,
        "conformsTo": "http://mlcommons.org/croissant/1.0",
        "citeAs": format!("{}: touches of the SPTS twin, version {}, spec {}", config.name, version(), spec.identity()),
        "license": "https://creativecommons.org/licenses/by/4.0/",
        "version": env!("CARGO_PKG_VERSION"),
        "distribution": [
            {"@type": "cr:FileSet", "@id": "parquet-files", "name": "parquet-files", "description": "the rows",
             "encodingFormat": "application/x-parquet", "includes": "data/*.parquet"},
        ],
        "recordSet": [{"@type": "cr:RecordSet", "@id": "rows", "name": "rows", "description": "one window of one touch", "field": fields}],
    })
}

#[cfg(test)]
mod tests {
    use super::short;

    #[test]
    fn numbers_are_short() {
        let told = [0.0, 1.0, -3.0, 0.25, 1234.5678, 1.23456e-5, -2.5e8, 4.194e15].map(short);
        assert_eq!(told, ["0", "1", "-3", "0.250", "1234.568", "1.23e-5", "-250000000", "4.19e15"]);
    }
}
