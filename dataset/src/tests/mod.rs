//! What a data set promises.

mod export;
mod folder;
mod moving;
mod rows;
mod specs;

use crate::spec::Spec;

/// A spec of `text`, which names no files.
fn spec(text: &str) -> Spec {
    Spec::from_toml(text, &toml::Table::new(), ".".as_ref()).unwrap()
}

/// A small data set of all kinds of draws, in five files.
const SMALL: &str = "rows = 90\nrows_per_shard = 20\nseed = 3
[object]
rows_per_shape = 10
count = { choice = [1, 2] }
[pose]
x_share = { uniform = [-0.3, 0.3] }
y_share = { grid = [-0.2, 0.0, 0.2] }
rotation_deg = { normal = [0.0, 40.0] }
[press]
force_n = { log_uniform = [5.0, 40.0] }
[skin]
rows_per_skin = 20
presses_before = { choice = [0, 2] }
[transducer]
temperature_c = { uniform = [10.0, 40.0] }
[faults]
count = { choice = [0, 3] }
[record]
windows = 2
measurements = 7
";
