//! The files that describe a data set, for people and for search programs.

use crate::columns::columns;
use crate::shard::version;
use crate::spec::{ObjectSource, Spec};
use crate::statistics::Statistics;
use crate::store::Kind;
use serde_json::{Value, json};
use std::fmt::Write as _;

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
    let size = SIZES
        .iter()
        .find(|(most, _)| statistics.rows < *most)
        .map_or("", |(_, size)| size);
    let skin = spec.skin();
    let (contact, _) = spec.contact();
    let objects = match config.object.from {
        ObjectSource::Shapes => "procedural shapes",
        ObjectSource::Objects => "the seventeen objects of the published recordings",
        ObjectSource::Meshes => "mesh files",
        ObjectSource::Ball => "a ball that falls",
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
        let _ = writeln!(
            text,
            "| `{}` | {kind} | {} | {least} | {mean} | {most} | {} |",
            c.name, c.unit, c.description
        );
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
        assert_eq!(
            told,
            ["0", "1", "-3", "0.250", "1234.568", "1.23e-5", "-250000000", "4.19e15"]
        );
    }
}
