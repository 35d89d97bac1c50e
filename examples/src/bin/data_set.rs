//! A data set of your own: labelled touches in Parquet files, and their columns read back. Run it again: files that are
//! there are kept, and give the same digest.
//!
//! `cargo run --release --bin data_set -- [FOLDER]`

use examples::Result;
use spts_dataset::{ColumnValues, Dataset, Part, Spec};

/// Procedural shapes anywhere on the sheet, pressed with 5 to 50 N; 20 samples of the one wire for each touch.
const SPEC: &str = "
name = 'my-touches'
rows = 400
rows_per_shard = 100
seed = 3

[object]
from = 'shapes'
rows_per_shape = 10

[pose]
x_share = { uniform = [-0.3, 0.3] }
y_share = { uniform = [-0.3, 0.3] }
rotation_deg = { uniform = [0, 360] }

[press]
force_n = { log_uniform = [5, 50] }
";

fn main() -> Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "out/data_set".to_owned());
    let spec = Spec::from_toml(SPEC, &toml::Table::new(), ".".as_ref())?;
    let dataset = Dataset::begin(folder.as_ref(), spec)?;
    let made = dataset.make(Part::WHOLE, &())?;
    println!("{folder}: {} rows made, {} files were there", made.rows, made.skipped);
    // statistics, a card for readers, and the digest: the same for the same spec, on any number of threads
    println!("digest: {}", dataset.finish(&())?.digest);

    let names = ["contact_force_n", "conductance_s", "split"];
    let columns = dataset.columns(&names, 0..400, || Ok(()))?;
    let values: Vec<&ColumnValues> = columns.iter().map(|(_, values)| values).collect();
    let [ColumnValues::Floats(forces), ColumnValues::Floats(images), ColumnValues::Texts(splits)] = values[..] else {
        return Err("a column has another type".into());
    };
    let rows_of = |name: &str| splits.iter().filter(|split| *split == name).count();
    let counts = ["train", "validation", "test"].map(|name| format!("{name} {}", rows_of(name)));
    println!("rows: {}", counts.join(", "));
    println!(" force, N   taxels that conduct   split");
    for row in [0, 100, 200, 300, 399] {
        let image = &images[100 * row..100 * (row + 1)];
        let pressed = image.iter().filter(|g| **g > 0.0).count();
        println!("{:9.1} {pressed:21}   {}", forces[row], splits[row]);
    }
    Ok(())
}
