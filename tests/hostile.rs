//! Whatever comes in that cannot be used: options and fields out of range, files of other programs, damaged ones, and
//! small ones that ask for much. Each ends in one line that names file, field, value and range, with status 2, at once
//! and with little memory, and nothing is written.

use crate::command::{SPTS, files, json, succeeds, words};
use crate::recordings::recordings;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde_json::Value;
use spts::session::{Event, Recorded, Session};
use spts::{Block, Recording, RecordingInfo, Seeding, SkinLayout, WeightMode, Weights};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// Status of every refusal.
const REFUSED: i32 = 2;
/// Address space of the program, kB: what it needs for itself, and less than any bomb.
const MEMORY_KB: &str = "2000000";
/// Longest time that a refusal may take.
const LIMIT: Duration = Duration::from_secs(5);

/// A folder for files that are to be refused.
struct Attack(tempfile::TempDir);

impl Attack {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn dir(&self) -> &Path {
        self.0.path()
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) -> &Self {
        let path = self.dir().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
        self
    }

    /// A pipe that nobody writes to, in the place of the file `name`.
    fn pipe(&self, name: &str) -> &Self {
        let path = self.dir().join(name);
        let _ = std::fs::remove_file(&path);
        assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
        self
    }

    /// Runs `spts` with these arguments, and expects one line of error with all of `facts` in it.
    #[track_caller]
    fn refused(&self, arguments: &[&str], facts: &[&str]) {
        let (before, begin) = (paths(self.dir()), Instant::now());
        let limited = ["-k", "1", "20", "sh", "-c", "ulimit -v $1; shift; exec \"$0\" \"$@\"", SPTS, MEMORY_KB];
        let mut command = Command::new("timeout");
        let output = command.args(limited).args(arguments).current_dir(self.dir()).output();
        let took = begin.elapsed();
        assert_refused(&output.unwrap(), &format!("{arguments:?}"), facts);
        assert!(took < LIMIT, "{arguments:?} took {took:?}");
        assert!(paths(self.dir()) == before, "{arguments:?}: something was written all the same");
    }
}

/// Names of all files and folders below `dir`, whose contents may be endless.
fn paths(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(dir).unwrap() {
        let entry = entry.unwrap();
        found.push(entry.path());
        if entry.file_type().unwrap().is_dir() {
            found.extend(paths(&entry.path()));
        }
    }
    found.sort();
    found
}

/// One error line without escape sequences, status 2, nothing on standard output. Notes may come first.
#[track_caller]
fn assert_refused(output: &Output, what: &str, facts: &[&str]) {
    let said = String::from_utf8_lossy(&output.stderr);
    let start: String = said.chars().take(400).collect();
    assert_eq!(output.status.code(), Some(REFUSED), "{what}: {:?}: {start}", output.status);
    let errors: Vec<&str> = said.lines().filter(|line| !line.starts_with("note: ")).collect();
    assert!(errors.len() == 1 && errors[0].starts_with("error: "), "{what}: {start}");
    assert!(said.len() < 1000, "{what}: {} bytes: {start}", said.len());
    assert!(!said.contains('\u{1b}'), "{what}: {}", start.escape_debug());
    for fact in facts {
        assert!(said.contains(fact), "{what}: `{fact}` is not in: {start}");
    }
    assert!(output.stdout.is_empty(), "{what}: something was printed all the same");
}

/// The cases of a table: a line each, of what is refused and the facts in its error, with ` | ` between them.
fn cases(table: &'static str) -> impl Iterator<Item = (&'static str, Vec<&'static str>)> {
    table.lines().filter(|line| !line.is_empty()).map(|line| {
        let (case, facts) = line.split_once(" | ").unwrap();
        (case, facts.split(" | ").collect())
    })
}

/// Command lines: every numeric option, and every way into an error.
const COMMANDS: &str = r#"
simulate press/T --threads 0 | `--threads` = 0 is outside the whole numbers in [1, 1024]
simulate press/T --presses 1e3 | `--presses` = 1e3 is outside the whole numbers in [1, 100000]
simulate press/T --cells 65 | `--cells` = 65 is outside the whole numbers in [1, 64]
simulate press --mesh a.obj --scale big | `--scale` = big is not a number
simulate press/T --col 1,5 | `--col` = 1,5 is not a number
simulate bounce --height high | `--height` = high is not a number
simulate press/T --rotation-deg 1rad | `--rotation-deg` = 1rad is not a number
simulate press/T --rotation-deg 361 | `press.rotation_deg` = 361 is outside [-360, 360]
simulate press/T --tilt-deg 3 | `--tilt-deg` = 3: two numbers with a comma between them are needed
simulate press/T --seed 9223372036854775809 | `--seed` = 9223372036854775809 is outside the whole numbers in [0, 2^63)
simulate press/T --seed -1 | `--seed` = -1 is outside the whole numbers in [0, 2^63)
simulate press/T --tolerance 1e-9 | `tolerance` = 1e-9 is outside [0.03, 1]
simulate press/T --timestep fast | `--timestep` = fast: a number of seconds or "auto" is needed
simulate press/T --contact footprint --timestep 1 | `timestep_s` = 1 is outside [1e-6, 2e-3] s
simulate press/T --fault dead:-1 | `--fault` = dead:-1: the name of a fault, a colon and a taxel are needed
decode d --measurements 0 | `--measurements` = 0 is outside the whole numbers in [1, 1000000]
decode d --windows 0 | `--windows` = 0 is outside the whole numbers in [1, 100000]
decode d --seed x | `--seed` = x is outside the whole numbers in [0, 2^63)
validate d --measurements 1001 | `--measurements` = 1001 is outside the whole numbers in [1, 1000]
score d --measurements 1000001 | `--measurements` = 1000001 is outside the whole numbers in [1, 1000000]
score d --against b --tolerance 2 | `--tolerance` = 2 is outside [0, 1]
score d --seed 18446744073709551615 | `--seed` = 18446744073709551615 is outside the whole numbers in [0, 2^63)
score d --quick | `--quick`: recordings have the presses they have
budget --measurements 0 | `--measurements` = 0 is outside the whole numbers in [1, 1000]
budget --taxels 99 | `--taxels` = 99 is outside the square numbers in [100, 1600]
circuit --taxels 0 | `--taxels` = 0 is outside the whole numbers in [1, 1000000000]
circuit --pressed nan | `--pressed` = nan is outside [0, 1]
circuit --pressed-us -1 | `--pressed-us` = -1 is outside [0, 1e6] µS
circuit --drive-v 0 | `--drive-v` = 0 is outside [1e-3, 1e3] V
circuit --feedback-ohm 0 | `--feedback-ohm` = 0 is outside [1e-9, 1e9] ohm
circuit --feedback-pf -1 | `--feedback-pf` = -1 is outside [0, 1e6]
circuit --rate-hz fast | `--rate-hz` = fast is not a number
circuit --sub-array 1 | `--sub-array` = 1 is outside the whole numbers in [2, 1000000]
design --area 0.1 --resolution 5mm --latency 5ms | `--area` = 0.1 is not WIDTHxHEIGHT with both in [0.001, 10] m
design --area 0.1x0.1 --resolution 2m --latency 5ms | `--resolution` = 2m is not a length in [0.1mm, 1m]
design --area 0.1x0.1 --resolution 5mm --latency -1 | `--latency` = -1 is not a time in [1us, 10s]
design --area 0.1x0.1 --resolution 5mm --latency 5ms --iou 1 | `--iou` = 1 is outside [0.01, 0.99]
design --area 0.1x0.1 --resolution 5mm --latency 5ms --wires 257 | `--wires` = 257 is outside the whole numbers in [1, 256]
design check d --seed x | `--seed` = x is outside
fidelity --taxels 15 | `--taxels` = 15 is outside the square numbers in [16, 16384]
fidelity --taxels 1024 --cells 13 | `--cells` = 13 is outside [1, 12] with --taxels 1024
fidelity --cells 25 | `--cells` = 25 is outside the whole numbers in [1, 24]
firmware verify --edges 0 | `--edges` = 0 is outside the whole numbers in [1, 1000000000]
firmware verify --cells 113 | `--cells` = 113 is outside the whole numbers in [1, 112]
firmware verify --edge-hz 0 | `--edge-hz` = 0 is outside [1, 1000000] Hz
firmware verify --sample-us late | `--sample-us` = late is not a number
firmware weights --out w.npy --edges 1000001 | `--edges` = 1000001 is outside the whole numbers in [1, 1000000]
firmware trace --taxel 112 | `--taxel` = 112 is outside the whole numbers in [0, 111]
firmware trace --from-reset 0 | `--from-reset` = 0 is outside the whole numbers in [1, 100000000]
reproduce --seed x | `--seed` = x is outside
compare d --seed x | `--seed` = x is outside
calibrate d --presses 3 | `--presses` = 3:
simulate press/anvil | press.object | anvil | tape
simulate press | press/NAME | bounce
simulate push/T | push/T | press/NAME
simulate . | SCENE | press/NAME
simulate none.toml | none.toml | No such file
simulate press/T --force -5 | force_n | -5 | [0.5, 100] N
simulate press/T --force NaN | force_n | NaN | [0.5, 100] N
simulate press/T --row 99 | press.row | 99 | rows + 4
simulate press/T --presses 0 | presses | 0 | [1, 100000]
simulate press/T --cells 1 --set skin.rows=1400 --set skin.cols=1400 --set skin.pitch_m=0.001 --set rows.seeding=mixed | presses × frames × taxels
simulate press/T --height 1 | --height | 1 | only a ball
simulate bounce --height 1e9 | drop.height_m | 1000000000 | [0.001, 5] m
simulate bounce --force 5 | --force | 5
simulate press/T --mesh a.obj | --mesh | press/T
simulate press --mesh none.obj | none.obj | No such file
simulate press/T --transducer foil | foil | velostat
simulate press/T --readout gone.toml | gone.toml | No such file
simulate press/T --fault lame:3 | `faults[0].name` = "lame" | dead, stuck, mis_seeded
simulate press/T --fault dead:100 | `faults[0].taxel` = 100 | [0, 99] | fault `dead`
simulate press/T --set faults.0.taxel=1 | `faults` is a list: `0` is the number of none of its entries (none yet); `faults.+` adds one
simulate press/T --set press.force_n=much | `press.force_n` = "much": a number is needed
simulate press/T --set transducer_parameters.temperature_c=x | `transducer_parameters.temperature_c` = "x": a number is needed
simulate press/T --set press.position_share=[0,0,0] | `press.position_share` = a list of 3: a list of 2 is needed
simulate press/T --set press.row=3 --set press.position_m=[0.01,0] | press.position_m=[0.01,0]: `press.row=3` says the same in another way
simulate press/T --row 3 --set press.position_share=[0,0] | press.position_share=[0,0]: `--row 3.0` says the same in another way
simulate press/T --tolerance 0.1 --set contact.model=layer | contact.model=layer: `--tolerance 0.1` says the same in another way
simulate press/T --timestep 1e-4 --set tolerance=0.1 | tolerance=0.1: `--timestep 0.0001` says the same in another way
simulate press/T --set rows.seeds=[1] --set rows.seeding=mixed | rows.seeding=mixed: `rows.seeds=[1]` says the same in another way
simulate | required | <SCENE>
simulate press/T --frce 3 | --frce | --force
simulat press/T | simulat | simulate
score d --twin press/T | RECORDINGS | --twin
validate nowhere | nowhere
validate . | no recordings found
score empty | no recordings found
score empty --decoder magic | `--decoder` = "magic"; valid: all, empty
score empty --against nowhere.json | nowhere.json
score | RECORDINGS
score d --external cat --external-timeout 0 | `--external-timeout` = | valid: [0.1, 86400] s
score d --external cat --external-timeout -1 | `--external-timeout` = | valid: [0.1, 86400] s
score d --external cat --external-timeout nan | `--external-timeout` = | valid: [0.1, 86400] s
score d --external cat --external-timeout 86401 | `--external-timeout` = | valid: [0.1, 86400] s
score --twin press/T --quick --in-time --decoder evidence | valid: nn_lmmse
score --twin press/T --quick --in-time --sensing chosen | --sensing
score --twin press/T --quick --worst-kind | `--worst-kind`: no rows are chosen
score --twin press/T --quick --in-time --anytime | --anytime
score --twin press/T --quick --in-time --save board.json | --save
score --twin press/T --quick --anytime --confidence 0.5 | outside (0.5, 1)
score --twin press/T --quick --anytime --confidence 1 | outside (0.5, 1)
score --twin press/T --quick --anytime --confidence -0.9 | outside (0.5, 1)
score --twin press/T --quick --anytime --confidence nan | outside (0.5, 1)
score --twin press/T --quick --anytime --confidence sure | --confidence
score --twin press/T --quick --anytime --save board.json | --save
score --twin press/T --quick --anytime --decoder omp,evidence | valid: nn_lmmse, amortised, evidence
score --twin press/T --confidence 0.9 | --anytime
calibrate nowhere | nowhere
calibrate empty | no recordings found
calibrate none | no recordings found
calibrate foreign | brain_random2.mat: not a readable MATLAB v5 file
calibrate none --presses 5-2 | 1 ≤ A ≤ B
compare nowhere | nowhere
compare empty | no recordings found
compare none | no recordings found
compare foreign | brain_random2.mat: not a readable MATLAB v5 file
compare empty --arm | empty
budget --objects brian | `brian` is neither "all" nor one of brain
budget --objects rec,rec | twice
budget --taxels 150 | [100, 1600]
budget --taxels 1600 --measurements 20,1000 | 1000 is outside [1, 960]
budget --decode best | script_s20, script_m4, matched
budget --readout as_bult | as_bult
budget --readout missing.toml | missing.toml
budget --readout bad.toml | sample_rate_hz
fidelity --scene spher | spher
fidelity --scene missing.toml | missing.toml
fidelity --scene T --scene T | twice
fidelity --cells 0 | [1, 24]
fidelity --cells x | --cells
bench run magic | magic | valid names: auto
bench run auto --tasks big | --tasks | big | small
bench run auto --track rows | auto | is of the track decoder
bench run nobody --track rows | nobody | valid names: random, cosine_signs
bench run auto= | auto= | no command
bench run auto=cat | auto | another name
bench run missing.py | missing.py | no such file
bench run auto --seed -1 | `--seed` = -1
bench verify missing.json | missing.json
bench table missing | missing
bench data big | big | small
circuit --pressed-us nan | --pressed-us | nan | [0, 1e6] µS
circuit --bus-pf -1 | --bus-pf | -1 | [0, 1e6] pF
circuit --taxel-pf inf | --taxel-pf | inf | [0, 1e6] pF
circuit --taxels 1000000000 --taxel-pf 1100 | --taxel-pf | 1.100e12 pF | [0, 1e12] pF
circuit --rate-hz 200000 | rate-hz | 200000
circuit --rate-hz nan | rate-hz | NaN
design --area nanx0.2 --resolution 5mm --latency 5ms | `--area` = nanx0.2 | [0.001, 10] m
design --area 0x0.2 --resolution 5mm --latency 5ms | `--area` = 0x0.2
design --area 0.3x0.2 --resolution nan --latency 5ms | `--resolution` = nan | [0.1mm, 1m]
design --area 0.3x0.2 --resolution 0mm --latency 5ms | `--resolution` = 0mm
design --area 0.3x0.2 --resolution 5mm --latency 0 | `--latency` = 0 | [1us, 10s]
design --area 0.3x0.2 --resolution 5mm --latency nan | `--latency` = nan
design --area 0.3x0.2 --resolution 5mm --latency 5us | `latency` = 0.000005 | measurements take that long
design --area 0.3x0.2 --resolution 5mm --latency 5ms --iou nan | `--iou` = nan
design --area 0.3x0.2 --resolution 5mm --latency 5ms --wires 0 | `--wires` = 0
design --area 0.3x0.2 --resolution 5mm --latency 5ms --wires 41 | `wires` = 41 is outside [1, 40]
design --area 0.3x0.2 --resolution 5mm --latency 5ms --objects cups | `objects` = "cups" | valid: small, large
design --area 10x10 --resolution 1mm --latency 5ms | 10000 × 10000 taxels | [2, 256] a side
design --area 0.01x0.01 --resolution 8mm --latency 5ms | 1 × 1 taxels
firmware verify --mode pattern --period 65 | [1, 64]
firmware verify --edge-hz nan | [1, 1000000]
firmware verify --image none.hex | none.hex
firmware verify --image broken.hex | broken.hex
firmware weights --out w.npy --mode pattern --period 0 | [1, 64]
firmware weights --out no/such/folder/w.npy | no/such/folder
firmware trace --taxel 100 | [0, 99]
simulate press/T --weights magic | `weights` = "magic" | known: model, firmware
simulate arm --set bend.radius_m=0.01 | bend.radius_m | 0.01 | [0.02, 10] m
simulate arm --set bend.taut_share=1.5 | bend.taut_share | 1.5 | [0, 1]
simulate arm --set bend.strain=0.5 | bend.strain | 0.5 | [0, 0.3]
simulate arm --set bend.strain_log_sd=3.0 | bend.strain_log_sd | 3 | [0, 2]
simulate arm --set bend.press_log_sd=-1.0 | bend.press_log_sd | -1 | [0, 1]
simulate arm --set bend.touch_slack=nan | bend.touch_slack | NaN | [0, 2]
simulate arm --set bend.tight=1 | tight | radius_m | strain
simulate arm --set contact.model=layer | contact.model | layer | "winkler", "footprint"
simulate arm --set press.places=[] | press.places | [] | [row, col]
simulate arm --set press.places=[[1,99]] | press.places: col | 99 | cols + 4
simulate bounce --set bend={} | [bend] | [press] | drops
dataset make shapes | shapes | random-shapes
dataset make missing.toml | missing.toml
dataset make bad_spec.toml | bad_spec.toml | `press.force_n` = 0 | [0.01, 1000] N
dataset make faults --rows 0 | --rows | 0 | [1, 1000000000000]
dataset make faults --shard 4/4 | `--shard` = 4/4 | 0 ≤ i < n
dataset make faults --out occupied | mine.txt | is not of a data set
dataset make presses-17 --rows 17 --out set --set transducer.gains="short.toml" | gains.log_mean.length` = 1
dataset finish occupied | dataset.json
dataset head nowhere | dataset.json
dataset specs --show presses | `--show` = presses | presses-17
dataset preview empty | empty/dataset.json
dataset preview nowhere | nowhere | random-shapes
dataset preview faults --rows 0 | --rows | [1, 150]
dataset preview faults --rows 151 | --rows | [1, 150]
dataset preview faults --out missing/folder/x.png | missing/folder
dataset shapes --families gear,cog | cog | gear
dataset shapes --count 0 | --count | [1, 400]
"#;

#[test]
fn command_lines() {
    let attack = Attack::new();
    for (name, text) in [
        ("bad.toml", "weights = \"binary\""),
        ("bad_spec.toml", "rows = 10\n[press]\nforce_n = { uniform = [0, 1] }"),
        ("short.toml", SHORT_GAINS),
        ("broken.hex", ":0400000001020304FF\n"),
        ("occupied/mine.txt", "mine"),
        ("foreign/presses/brain/brain_random2.mat", "not MATLAB"),
        ("foreign/presses/brain/brain_random2_time.mat", "not MATLAB"),
    ] {
        attack.write(name, text);
    }
    for folder in ["empty", "none/presses"] {
        std::fs::create_dir_all(attack.dir().join(folder)).unwrap();
    }
    for (command, facts) in cases(COMMANDS) {
        attack.refused(&words(command), &facts);
    }
    for command in ["--help", "simulate --help", "--version", "help"] {
        assert!(!succeeds(attack.dir(), &words(command)).stdout.is_empty(), "{command}");
    }
}

/// Gains of a skin of one taxel.
const SHORT_GAINS: &str = "log_mean = [0.0]\nlog_sd = [0.1]\nmounting_log_sd = 0.1\n";

/// Scene files: their lines with `;` between them, and `P` for a press of an object.
const SCENES: &str = r#"
sed = 3 ; P | line 1 | sed | seed
P ; forec_n = 3.0 | line 3 | forec_n | force_n
P ; force_n = -3.0 | press.force_n | -3 | [0.5, 100] N
P ; force_n = "much" | line 3 | `press.force_n` = "much": a number is needed
P ; [contact] ; stifness = 1e7 | stifness
seed = -1 ; P | line 1 | `seed` = -1: a whole number from 0 on is needed
[press | line 1
transducer = "foil" ; P | `transducer` = "foil" is not a transducer; known: linear, velostat
readout = "perfect" ; P | `readout` = "perfect" is not a readout profile; known: ideal | as_built
readout = "gone.toml" ; P | gone.toml | No such file
weights = "wood" ; P | `weights` = "wood" is not a source of weights; known: model, firmware
[transducer_parameters] ; temperature_c = 900 ; P | `transducer_parameters.temperature_c` = 900 is outside [-45, 65]
[transducer_parameters] ; temperature_c = "hot" ; P | `transducer_parameters.temperature_c` = "hot": a number is needed
[transducer_parameters.creep] ; start_s = true ; P | `transducer_parameters.creep.start_s` = true: a number is needed
[[faults]] ; name = "lame" ; taxel = 3 ; P | `faults[0].name` = "lame" is not a fault; known: dead
[[faults]] ; name = "dead" ; taxel = 100 ; P | `faults[0].taxel` = 100 is outside [0, 99]
[[faults]] ; name = "dead" ; taxel = -1 ; P | `faults[0].taxel` = -1: a whole number in [0, 2^32) is needed
[[faults]] ; name = "stuck" ; taxel = 1 ; level = "up" ; P | `faults[0].level` = "up": a number is needed
[[faults]] ; name = "stuck" ; taxel = 3 ; level = 2.0 ; P | `faults[0].level` = 2 | [−1, 1] | fault `stuck` of taxel 3
skin.pitch_m = 1e308 ; P | `skin.pitch_m` = 1e308 is outside [1e-6, 1] m
skin.pitch_m = nan ; P | `skin.pitch_m` = NaN is outside [1e-6, 1] m
skin.rows = 1.5 ; P | `skin.rows` = 1.5: a whole number from 0 on is needed
skin = "large" ; P | `skin` = "large": a table is needed
skin.rows = 100000 ; skin.cols = 100000 ; P | rows × cols
contact.cells_per_taxel = 1.5 ; P | `contact.cells_per_taxel` = 1.5: a whole number from 0 on is needed
contact.cells_per_taxel = 1000000000 ; P | cells_per_taxel
contact.friction = "some" ; P | `contact.friction` = "some": a number is needed
rows.seeds = [-1] ; P | a whole number in [0, 2^32) is needed
timestep_s = true ; P | `timestep_s` = true: 
chosen_for_tolerance = nan ; P | `chosen_for_tolerance` = NaN is outside [0.03, 1]
frame_interval_s = inf ; P | `frame_interval_s` = inf is outside [timestep_s, 0.1] s
[transducer_parameters] ; gains = "short.toml" ; P | gains.log_mean.length` = 1 | one value a taxel
[transducer_parameters] ; gains = "nothing.toml" ; P | `gains` | nothing.toml
[transducer_parameters] ; gains = "wrong.toml" ; P | wrong.toml | gains.log_mean[0]` = 9 is outside [-5, 5]
P ; scale = nan | `press.scale` = NaN is outside (0, 1000]
P ; scale = 2.0 | `press.scale` is for a mesh, and `press.object` = "T" has its own size
P ; presses = -1 | `press.presses` = -1: a whole number from 0 on is needed
P ; presses = 4000000000 | presses | [1, 100000]
P ; position_m = [1.0] | `press.position_m` = a list of 1: a list of 2 is needed
P ; position_m = [0.0, 0.0, 0.0] | `press.position_m` = a list of 3: a list of 2 is needed
P ; position_m = [9.0, 0.0] | `press.position_m (x)` = 9 is outside [-0.1425, 0.1425] m
P ; position_m = [0.0, nan] | `press.position_m (y)` = NaN is outside [-0.1425, 0.1425] m
P ; position_share = [0.0, 2.0] | `press.position_share (y)` = 2 is outside [-0.95, 0.95]
"#;

#[test]
fn scene_files() {
    let attack = Attack::new();
    let press = "[press]\nobject = \"T\"";
    attack.write("short.toml", SHORT_GAINS);
    attack.write("wrong.toml", SHORT_GAINS.replace("[0.0]", "[9.0]"));
    for (scene, facts) in cases(SCENES) {
        let lines = scene.split(" ; ").map(|line| if line == "P" { press } else { line });
        attack.write("mine.toml", lines.collect::<Vec<_>>().join("\n"));
        attack.refused(&["simulate", "mine.toml"], &[&["mine.toml: "][..], &facts].concat());
    }
    // small files that ask for much, and text that is none
    let scene = |text: &[u8], facts: &[&str]| {
        attack.write("mine.toml", text);
        attack.refused(&["simulate", "mine.toml"], &[&["mine.toml"], facts].concat());
    };
    let wide: Vec<u8> = "\u{feff}v 0 0 0\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    scene(&wide, &["UTF-16"]);
    scene(&[0xff, 0xfe, 0x00], &["utf-8"]);
    scene(format!("name = {}\n", "[".repeat(1_000_000)).as_bytes(), &["line 1"]);
    scene(format!("{}\n", "a.".repeat(500_000) + "a = 1").as_bytes(), &["line 1"]);
    scene("x".repeat(5_000_000).as_bytes(), &["5000000 bytes", "[0, 2097152]"]);
    let seeds = format!("[rows]\nseeds = [{}0]\n{press}", "0,".repeat(1_000_000));
    scene(seeds.as_bytes(), &["number of seeds"]);
    // what a scene names: pipes, too much, and a byte-order mark that spoils neither of two seeds
    let seeded = format!("\u{feff}{press}\n[rows]\nseeds_file = \"seeds.txt\"\n");
    attack.write("seeded.toml", &seeded).pipe("seeds.txt").pipe("pipe.toml");
    let not_regular = "not a regular file";
    attack.refused(&["simulate", "pipe.toml"], &["pipe.toml", not_regular]);
    attack.refused(&words("simulate press/T --readout pipe.toml"), &["pipe.toml", not_regular]);
    attack.refused(&["simulate", "seeded.toml"], &["seeds.txt", not_regular]);
    std::fs::remove_file(attack.dir().join("seeds.txt")).unwrap();
    attack.write("seeds.txt", "x".repeat(1 << 23));
    attack.refused(&["simulate", "seeded.toml"], &["seeds.txt", "seed = `xxx"]);
    attack.write("seeds.txt", "\u{feff}8 9\n");
    attack.refused(&["simulate", "seeded.toml"], &["seeds.txt", "number of seeds = 2"]);
}

#[test]
fn readout_profiles() {
    let attack = Attack::new();
    let shipped = |name: &str| spts_circuit::PROFILES.iter().find(|(known, _)| *known == name).unwrap().1;
    for (name, from, to, facts) in [
        ("ideal", "", "[raster]\nmagic = {}\n", &["magic"][..]),
        ("ideal", "drive_v = ", "drive_v = -", &["drive_v", "-4.3", "[1e-3, 1e3]"]),
        ("ideal", "sample_rate_hz = ", "sample_rate_hz = 1e9 # ", &["presses × measurements"]),
        (
            "as_built",
            "drive_v = ",
            "drive_v = \"high\" # ",
            &["wire.toml: line ", "`drive_v` = \"high\": a number is needed"],
        ),
        ("as_built", "bits = ", "bits = \"many\" # ", &["bits` = \"many\": "]),
        (
            "as_built",
            "sample_rate_hz = ",
            "sample_rate_hz = -1 # ",
            &["`readout.sample_rate_hz` = -1 is outside [1, 1e9]"],
        ),
        ("as_built", "sample_rate_hz = ", "sample_rate_ = ", &["sample_rate_hz"]),
    ] {
        let text = match from {
            "" => format!("{}\n{to}", shipped(name)),
            from => shipped(name).replacen(from, to, 1),
        };
        attack.write("wire.toml", text);
        let file = if to.contains("1e9") { &[][..] } else { &["wire.toml: "] };
        attack.refused(&words("simulate press/T --readout wire.toml"), &[file, facts].concat());
    }
}

/// A tetrahedron of edge about 30 mm; the files below are this one, damaged.
const TETRAHEDRON: &str = "v 0 0 0\nv 0.03 0 0\nv 0 0.03 0\nv 0 0 0.03\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

fn corpus(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus").join(file)
}

/// A GLB of this description and data.
fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], with: u8| {
        let mut bytes = bytes.to_vec();
        bytes.resize(bytes.len().next_multiple_of(4), with);
        bytes
    };
    let word = |n: usize| u32::try_from(n).unwrap().to_le_bytes();
    let (json, bin) = (padded(json.as_bytes(), b' '), padded(bin, 0));
    let length = 12 + 8 + json.len() + 8 + bin.len();
    [&b"glTF\x02\0\0\0"[..], &word(length), &word(json.len()), b"JSON", &json, &word(bin.len()), b"BIN\0", &bin]
        .concat()
}

/// `nodes` and `primitives` of a scene whose only data are three thousand points.
fn shared(nodes: &str, primitives: usize) -> Vec<u8> {
    let primitive = r#"{"attributes":{"POSITION":0}}"#;
    let primitives = vec![primitive; primitives].join(",");
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{nodes}],"meshes":[{{"primitives":[{primitives}]}}],"accessors":[{{"bufferView":0,"componentType":5126,"count":3000,"type":"VEC3"}}],"bufferViews":[{{"buffer":0,"byteLength":36000}}],"buffers":[{{"byteLength":36000}}]}}"#
    );
    glb(&json, &[0; 36_000])
}

#[test]
fn meshes() {
    let attack = Attack::new();
    let mesh = |name: &str, facts: &[&str]| {
        attack.refused(&["simulate", "press", "--mesh", name], &[&[name], facts].concat());
    };
    let mut counts = vec![0; 84];
    counts[80..].copy_from_slice(&u32::MAX.to_le_bytes());
    let mut many = vec![0; 84 + 50 * 2_000_000];
    many[80..84].copy_from_slice(&2_000_000_u32.to_le_bytes());
    let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf";
    let [wide, deeper] = ["1", "2"].map(|child| vec![child; 20_000].join(","));
    // each of thirty levels names the next one twice
    let levels: Vec<String> = (1..30).map(|k| format!(r#"{{"children":[{k},{k}]}}"#)).collect();
    let utf16: Vec<u8> = "\u{feff}v 0 0 0\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let files: [(&str, Vec<u8>, &[&str]); 17] = [
        ("nan.obj", TETRAHEDRON.replace("v 0 0 0.03", "v 0 0 nan").into(), &["line 4", "z = `nan`"]),
        ("large.obj", TETRAHEDRON.replace("0.03", "30").into(), &["30", "[0.001, 2] m", "scale = 0.001"]),
        // the underside is missing; the face with one vertex on top would be closed above it
        ("open.obj", TETRAHEDRON.replace("f 1 3 2\n", "").into(), &["not closed", "3 of 6", "at (", "downward"]),
        ("far.obj", std::fs::read(corpus("obj/far.obj")).unwrap(), &["vertex", "x = 3", "[-10000000, 10000000] m"]),
        ("wide.obj", utf16, &["UTF-16"]),
        ("text.glb", b"not a GLB".into(), &["malformed"]),
        ("short.stl", b"not an STL".into(), &["malformed", "10 bytes"]),
        ("solid.step", b"ISO-10303-21;".into(), &["step", "obj, glb, stl"]),
        // 150 visits of 100 primitives of 3000 points
        (
            "shared.glb",
            shared(&format!(r#"{{"children":[{}]}},{{"mesh":0}}"#, vec!["1"; 150].join(",")), 100),
            &["number of triangles", "[0, 1000000]"],
        ),
        ("levels.glb", shared(&(levels.join(",") + r#",{"mesh":0}"#), 1), &["100000"]),
        // nodes with many children each: the list of what is to be visited grows, too
        ("wide.glb", shared(&format!(r#"{{"children":[{wide}]}},{{"children":[{deeper}]}},{{}}"#), 1), &["100000"]),
        ("nodes.glb", shared(&vec!["{}"; 1_500_000].join(","), 1), &["JSON", "2097152"]),
        ("counts.stl", counts, &["4294967295 triangles"]),
        ("many.stl", many, &["number of triangles = 2000000", "[0, 1000000]"]),
        (
            "polygon.obj",
            (triangle.to_owned() + &" 1 2 3".repeat(4_000_000)).into(),
            &["number of triangles = 11999998"],
        ),
        ("faces.obj", format!("{triangle} 1 2 3\n{}", "f 1 2 3\n".repeat(2_000_000)).into(), &["number of triangles"]),
        ("index.obj", format!("{triangle} 1 2 99999999999999999999999\n").into(), &["malformed"]),
    ];
    for (name, content, facts) in files {
        attack.write(name, content);
        mesh(name, facts);
        std::fs::remove_file(attack.dir().join(name)).unwrap();
    }
    let sparse = std::fs::File::create(attack.dir().join("sparse.obj")).unwrap();
    sparse.set_len(1 << 40).unwrap();
    mesh("sparse.obj", &["1099511627776", "[0, 268435456]"]);
    std::os::unix::fs::symlink("/dev/zero", attack.dir().join("endless.obj")).unwrap();
    mesh("endless.obj", &["not a regular file"]);
    attack.pipe("pipe.stl");
    mesh("pipe.stl", &["a pipe, not a regular file"]);
    attack.write("good.obj", TETRAHEDRON);
    for scale in ["0", "-1", "nan", "inf"] {
        attack.refused(&["simulate", "press", "--mesh", "good.obj", "--scale", scale], &["scale", "(0, "]);
    }
}

/// A mesh inside out is turned, with a note; a byte-order mark, which some editors put first, is no part of its first
/// line.
#[test]
fn meshes_that_are_read_all_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let turned = TETRAHEDRON.replace("f 1 3 2", "f 1 2 3").replace("f 1 2 4", "f 1 4 2");
    let turned = turned.replace("f 1 4 3", "f 1 3 4").replace("f 2 3 4", "f 2 4 3");
    std::fs::write(dir.path().join("turned.obj"), turned).unwrap();
    let output = succeeds(dir.path(), &words("simulate press --mesh turned.obj --force 2"));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.starts_with("note: ") && said.contains("inside out"), "{said}");
    let [plain, marked] = ["tetrahedron", "mark"].map(|name| {
        let mesh = corpus(&format!("obj/{name}.obj"));
        let run = ["simulate", "press", "--mesh", mesh.to_str().unwrap(), "--out", name];
        succeeds(dir.path(), &[&run[..], &words("--scale 0.001 --force 2 --no-record")].concat());
        std::fs::read(dir.path().join(name).join("pressure_pa.npy")).unwrap()
    });
    assert!(plain == marked, "the pressures differ");
}

/// Each repair has its line, and the summary has them in numbers.
#[test]
fn meshes_that_are_mended_say_so() {
    let dir = tempfile::tempdir().unwrap();
    // a corner given twice, a triangle given twice, one turned over, the top open, in millimetres, beside its origin
    let damaged = TETRAHEDRON
        .replace("0.03", "30")
        .replace("v 0 ", "v 10 ")
        .replace("v 30 ", "v 40 ")
        .replace("f 1 4 3", "f 1 3 4")
        .replace("f 2 3 4", "v 40 0 0\nf 5 2 1\nf 1 3 5");
    std::fs::write(dir.path().join("cup.obj"), damaged).unwrap();
    let output = succeeds(dir.path(), &words("simulate press --mesh cup.obj --scale 0.001 --force 2"));
    let said = String::from_utf8(output.stderr).unwrap();
    for fact in [
        "1 vertex of the mesh coincided",
        "without area was dropped",
        "1 triangle of the mesh was there before",
        "1 triangle of the mesh was turned",
        "opens upward and was closed",
        "(25.0, 15.0) mm",
    ] {
        assert!(said.lines().any(|l| l.starts_with("note: ") && l.contains(fact)), "`{fact}` is not in: {said}");
    }
    let summary = std::fs::read_to_string(dir.path().join("out/cup/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    for (key, count) in [
        ("joined_vertices", 1),
        ("duplicate_triangles", 1),
        ("turned_triangles", 1),
        ("dropped_triangles", 1),
        ("lids", 1),
    ] {
        assert_eq!(summary["mesh"][key], count, "{key}");
    }
    assert!(summary["mesh"]["decimation_error_m"].is_null());
}

/// A MATLAB file whose variable `C` is of class double and stored as `bytes` bytes, which are zero, compressed.
fn mat(bytes: usize) -> Vec<u8> {
    let word = |n: usize| u32::try_from(n).unwrap().to_le_bytes();
    let frames = bytes / 100;
    let head = [
        &word(6)[..],
        &word(8),
        &word(6),
        &word(0), // flags: class double
        &word(5),
        &word(12),
        &word(100),
        &word(frames),
        &word(1),
        &word(0), // sides, padded
        &word(1 | 1 << 16),
        b"C\0\0\0", // name
        &word(2),
        &word(bytes),
    ]
    .concat();
    let padded = bytes.next_multiple_of(8);
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::fast());
    packed.write_all(&[word(14), word(head.len() + padded)].concat()).unwrap();
    packed.write_all(&head).unwrap();
    let zeros = vec![0; 1 << 16];
    let mut left = padded;
    while left > 0 {
        let n = left.min(zeros.len());
        packed.write_all(&zeros[..n]).unwrap();
        left -= n;
    }
    let packed = packed.finish().unwrap();
    let mut file = vec![b' '; 124];
    file.extend([0, 1, b'I', b'M']);
    file.extend([word(15), word(packed.len())].concat());
    file.extend(packed);
    file
}

#[test]
fn published_recordings() {
    let attack = Attack::new();
    // a MATLAB v5 header, and a matrix that claims 1000 bytes and has 16
    let mut truncated = b"MATLAB 5.0 MAT-file".to_vec();
    truncated.resize(124, b' ');
    truncated.extend([0x00, 0x01, b'I', b'M', 14, 0, 0, 0, 0xe8, 3, 0, 0]);
    truncated.extend([0; 16]);
    let mut hdf5 = b"MATLAB 7.3 MAT-file".to_vec();
    hdf5.resize(512, b' ');
    hdf5.extend(b"\x89HDF\r\n\x1a\n");
    let of_struct = std::fs::read(corpus("mat/struct.mat")).unwrap();
    // the same variable under the name that is looked for first
    let at = of_struct.windows(9).rposition(|w| w == b"\x01\0\0\0\x01\0\0\0C").unwrap();
    let mut renamed = of_struct.clone();
    renamed[at + 8] = b'D';
    let name = "presses/T/T_raster.mat";
    for (content, fact) in [
        (Vec::new(), "ends after 0 bytes"),
        (truncated, "not a readable MATLAB v5 file"),
        (hdf5, "a MATLAB v7.3 file (HDF5)"),
        (b"a,b\n1,2\n".to_vec(), "not a readable MATLAB v5 file"),
        (of_struct, "`C` is a struct"),
        (renamed, "`D` is a struct"),
        // more than is unfolded, and what would be eight times as much as doubles
        (mat(900_000_000), "unfolds to more"),
        (mat(240_000_000), "holds 240000000 values"),
    ] {
        attack.write(name, content);
        attack.refused(&["validate", "."], &["T_raster.mat", fact]);
    }
    attack.pipe(name);
    attack.refused(&["validate", "."], &["T_raster.mat", "not a regular file"]);
}

/// A session of two blocks of 1 × 8 taxels in volts.
fn session(dir: &Path) {
    let layout = SkinLayout::new(1, 8, 5e-3, 3e-3).unwrap();
    let info = RecordingInfo::new(layout, Weights::new(WeightMode::Binary, Seeding::Mixed, 8), 64_300.0);
    let block = |end| Block { frame_position: end, idle_frames: None, volts: vec![0.25; 80] };
    let recording = Recording::new(info, vec![block(10), block(20)]).unwrap();
    let mut session = Session::new("cup", Event::Press);
    session.compressive = Some(Recorded::new(recording));
    session.write(dir).unwrap();
}

#[test]
fn sessions() {
    let attack = Attack::new();
    let folder = attack.dir().join("cup");
    session(&folder);
    let text = std::fs::read_to_string(folder.join("session.json")).unwrap();
    let json: Value = serde_json::from_str(&text).unwrap();
    let array = json["compressive"]["samples"]["file"].as_str().unwrap();
    let whole = std::fs::read(folder.join(array)).unwrap();
    // without it, a changed file is not compared with what was written
    std::fs::remove_file(folder.join("manifest.json")).unwrap();
    let decode = |facts: &[&str]| attack.refused(&["decode", "cup"], facts);
    let nested = format!("\"name\": {}", "[".repeat(1_000_000));
    let endless = format!("\"provenance\": [{}0]", "0,".repeat(10_000_000));
    for (from, to, facts) in [
        ("\"rows\": 1,", "\"rows\": 1000000000,", &["session.json", "rows × cols"][..]),
        ("\"rows\": 1,", "\"rows\": \"one\",", &["session.json", "`compressive.info.layout", "line "]),
        ("\"frames\": 10", "\"frames\": 18446744073709551615", &[array, "shape"]),
        ("\"name\": \"cup\"", &nested, &["session.json", "line "]),
        ("\"provenance\": null", &endless, &["session.json"]),
    ] {
        assert!(text.contains(from), "{from} is not in {text}");
        attack.write("cup/session.json", text.replacen(from, to, 1));
        decode(facts);
    }
    attack.write("cup/session.json", &text);
    let file = format!("cup/{array}");
    let header = |to: &str| {
        let end = 10 + usize::from(u16::from_le_bytes([whole[8], whole[9]]));
        let text = String::from_utf8_lossy(&whole[10..end]);
        assert!(text.contains("2, 10, 8"), "{text}");
        let text = text.replace("2, 10, 8", to);
        let length = u16::try_from(text.len()).unwrap().to_le_bytes();
        [&whole[..8], &length, text.as_bytes(), &whole[end..]].concat()
    };
    attack.write(&file, header("9999999999, 9999999999, 9999999999"));
    decode(&[array, "9999999999", "expected [2, 10, 8]"]);
    attack.write(&file, [&whole[..6], &[2, 0, 255, 255, 255, 255]].concat());
    decode(&[array, "header length = 4294967295"]);
    attack.write(&file, &whole);
    let sparse = std::fs::OpenOptions::new().write(true).open(attack.dir().join(&file)).unwrap();
    sparse.set_len(1 << 30).unwrap();
    decode(&[array, "bytes of values"]);
    for name in [array, "session.json"] {
        attack.pipe(&format!("cup/{name}"));
        decode(&[name, "a pipe", "not a regular file"]);
    }
}

/// Sessions that can be read and make no sense: true maps that cannot be, and what cannot be scored, which cannot be
/// decoded either.
#[test]
fn sessions_that_cannot_be_used() {
    let attack = Attack::new();
    for run in ["press/T --out run", "bounce --height 0.05 --out ball", "press/T --out both/a"] {
        succeeds(attack.dir(), &[&["simulate"], &words(run)[..]].concat());
    }
    succeeds(attack.dir(), &words("simulate press/X --set skin.rows=12 --out both/b"));
    let learned = ["`--decoder` = evidence", "raster presses that are not scored", "--learn-from simulation"];
    attack.refused(&words("score run --decoder evidence"), &learned);
    attack.refused(&["score", "ball"], &["ball: ", "found: no session of presses"]);
    attack.refused(&["score", "both"], &["both: session \"", " recording: `taxels` = ", "as the first session"]);
    let run = attack.dir().join("run");
    // what is changed is to be judged by itself
    std::fs::remove_file(run.join("manifest.json")).unwrap();
    let file = run.join("compressive_conductance_s.npy");
    let whole = std::fs::read(&file).unwrap();
    for value in [f64::INFINITY, -1e-3, f64::NAN] {
        let mut damaged = whole.clone();
        // the last of a hundred taxels
        let at = damaged.len() - 8;
        damaged[at..].copy_from_slice(&value.to_le_bytes());
        std::fs::write(&file, damaged).unwrap();
        let facts = ["compressive_conductance_s.npy", "entry 99", &value.to_string(), "[0, ∞)"];
        attack.refused(&["decode", "run"], &facts);
    }
    std::fs::write(&file, whole).unwrap();
    let file = run.join("session.json");
    let mut json: Value = serde_json::from_slice(&std::fs::read(&file).unwrap()).unwrap();
    json["hold_s"] = serde_json::json!([1.0, 1000.0]);
    std::fs::write(&file, json.to_string()).unwrap();
    for command in ["score", "decode"] {
        attack.refused(&[command, "run"], &["T", "frames", "at least"]);
    }
}

/// A finger's touch is in no class, so that no share of it can be classified correctly.
#[test]
fn an_object_in_no_class_is_not_wrong() {
    let Some(recordings) = recordings() else { return };
    let dir = tempfile::tempdir().unwrap();
    let command = "--session robot_arm --decoder nn_omp --measurements 20 --windows 2";
    let arguments = [&["decode", recordings.to_str().unwrap()][..], &words(command)].concat();
    let output = succeeds(dir.path(), &arguments);
    let said = String::from_utf8_lossy(&output.stdout);
    let row = said.lines().find(|line| line.starts_with("| robot_arm"));
    let classified = row.and_then(|row| row.trim_end_matches([' ', '|']).rsplit(' ').next());
    assert_eq!(classified, Some("–"), "{said}");
}

/// Names with escape sequences: what is printed has none, wherever the name comes from.
#[test]
fn names_do_not_reach_the_terminal_as_they_are() {
    let attack = Attack::new();
    let quiet = |arguments: &[&str]| attack.refused(arguments, &["u{1b}"]);
    for text in [
        "[press]\nobject = \"E\"",
        "contact.model = \"E\"\n[press]\nobject = \"T\"",
        "name = \"E\"\n[press]\nobject = \"T\"",
        "transducer = \"E\"\n[press]\nobject = \"T\"",
        "readout = \"E\"\n[press]\nobject = \"T\"",
        "[[faults]]\nname = \"E\"\ntaxel = 1\n[press]\nobject = \"T\"",
        "\"E\" = 1\n[press]\nobject = \"T\"",
    ] {
        attack.write("mine.toml", text.replace("\"E\"", "\"a\\u001b[31mb\""));
        quiet(&["simulate", "mine.toml"]);
    }
    let escape = "a\u{1b}[31mb";
    for command in ["simulate", "decode", "validate", "score", "calibrate"] {
        quiet(&[command, escape]);
    }
    quiet(&["simulate", "press/T", "--set", &format!("press.{escape}=1")]);
    quiet(&["simulate", "press/T", "--fault", &format!("{escape}:1")]);
    quiet(&["simulate", "press/T", "--presses", escape]);
}

/// A limit on the size of files makes writes fail half-way, as a full disk does, without any privilege.
#[test]
fn a_write_that_fails_half_way_damages_nothing() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), &["simulate", "press/T", "--out", "results"]);
    let before = files(dir.path());
    for blocks in ["1", "64", "800"] {
        let script = "trap '' XFSZ; ulimit -f $1; exec \"$0\" simulate press/X --out results";
        let mut command = Command::new("sh");
        let output = command.args(["-c", script, SPTS, blocks]).current_dir(dir.path()).output();
        assert_refused(&output.unwrap(), blocks, &["results/", "cannot be written", "File too large"]);
        assert!(files(dir.path()) == before, "damaged with a limit of {blocks} blocks");
    }
}

/// A disk that is really full, where a file system may be mounted.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_named_and_nothing_half_written_stays() {
    const CANNOT_MOUNT: i32 = 77;
    let dir = tempfile::tempdir().unwrap();
    // what is known before, and the pictures, which are not
    for (size, arguments, facts) in [
        ("256k", "simulate press/T", ["a run of 1 presses or drops needs 2 MB", "MB are free"]),
        ("2700k", "simulate press/T", ["cannot be written", "No space left"]),
    ] {
        let script = format!(
            "mount -t tmpfs -o size={size} none \"$1\" || exit 77; \"$0\" {arguments} --out \"$1/o\"; s=$?; ls -A \"$1\"; \
             exit $s"
        );
        let mut command = Command::new("unshare");
        match command.args(["-rm", "sh", "-c", &script, SPTS]).arg(dir.path()).output() {
            Ok(output) if output.status.code() == Some(REFUSED) => assert_refused(&output, arguments, &facts),
            Ok(output) if output.status.success() => panic!("a full disk went unnoticed: {arguments}"),
            Ok(output) if output.status.code() != Some(CANNOT_MOUNT) && !output.stdout.is_empty() => {
                panic!("{}", String::from_utf8_lossy(&output.stderr))
            }
            _ => eprintln!("skipped: no file system can be mounted here"),
        }
    }
}

/// A reader that goes away is no error and no panic.
#[test]
fn a_closed_pipe_is_not_an_error() {
    let dir = tempfile::tempdir().unwrap();
    for arguments in ["simulate press/T --json", "simulate press/X", "simulate --help"] {
        let script = format!("{{ \"$0\" {arguments} 2>said; echo $? >status; }} | true");
        let run = Command::new("sh").args(["-c", &script, SPTS]).current_dir(dir.path()).status();
        assert!(run.unwrap().success());
        let read = |name: &str| std::fs::read_to_string(dir.path().join(name)).unwrap();
        assert_eq!((read("status").trim(), read("said").as_str()), ("0", ""), "{arguments}");
    }
}

/// A box `side` units wide and high, as text of an OBJ file.
fn block(side: f64) -> String {
    let corner = |k: usize| [k & 1, k >> 1 & 1, k >> 2 & 1].map(|bit| (bit as f64 - 0.5) * side);
    let corners = (0..8).map(corner).map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let faces = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"].map(|face| format!("f {face}\n"));
    corners.chain(faces).collect()
}

/// Presses without a recording and with the cheapest contact; the folder that the results went to, and what was said.
fn pressed(dir: &Path, arguments: &str) -> (String, String) {
    let quick = words("--no-record --contact footprint --set press.presses=1");
    let output = succeeds(dir, &[&words(arguments)[..], &quick].concat());
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    let last = printed.lines().last().unwrap_or_default();
    let folder = last.split(':').next().unwrap_or_default().to_owned();
    (folder, String::from_utf8_lossy(&output.stderr).into_owned())
}

/// Two meshes of one name, and a mesh with the name of an object, keep their results apart; the same mesh again
/// replaces its own, and says so.
#[test]
fn meshes_do_not_overwrite_each_other() {
    let dir = tempfile::tempdir().unwrap();
    for (folder, name, side) in [("a", "cup", 0.04), ("b", "cup", 0.05), ("a", "T", 0.03)] {
        let folder = dir.path().join(folder);
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join(format!("{name}.obj")), block(side)).unwrap();
    }
    let run = |arguments: &str| pressed(dir.path(), arguments);
    let said = |text: &str| text.contains("has the results of an earlier run");
    for (arguments, folder, replaces) in [
        ("simulate press --mesh a/cup.obj", "out/cup", false),
        ("simulate press --mesh b/cup.obj", "out/cup_2", false),
        ("simulate press --mesh a/cup.obj --force 12", "out/cup", true),
        ("simulate press/T", "out/T", false),
        ("simulate press --mesh a/T.obj", "out/T_2", false),
        ("simulate press/T", "out/T", true),
    ] {
        let (found, stderr) = run(arguments);
        assert_eq!(found, folder, "{arguments}");
        assert_eq!(said(&stderr), replaces, "{arguments}: {stderr}");
    }
    let mesh = |folder: &str| files(&dir.path().join("out").join(folder))["mesh.obj"].clone();
    assert_eq!(mesh("cup"), block(0.04).into_bytes());
    assert_eq!(mesh("cup_2"), block(0.05).into_bytes());
}

#[test]
fn scenes_and_objects_are_listed() {
    let dir = tempfile::tempdir().unwrap();
    let text = succeeds(dir.path(), &["simulate", "--list"]).stdout;
    let text = String::from_utf8_lossy(&text).into_owned();
    let json: Value = json(dir.path(), &["simulate", "--list", "--json"]);
    assert_eq!(json["objects"].as_array().unwrap().len(), 18);
    for (list, key) in [("scenes", "scene"), ("objects", "name")] {
        for entry in json[list].as_array().unwrap() {
            let [name, about] = [key, "about"].map(|key| entry[key].as_str().unwrap());
            let row = [name, about];
            let mut cells = text.lines().map(|line| line.split('|').map(str::trim).collect::<Vec<_>>());
            assert!(cells.any(|cells| cells.get(1..3) == Some(&row)), "{name}: {text}");
        }
    }
    assert!(files(dir.path()).is_empty());
}
