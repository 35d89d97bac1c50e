//! `spts phase`: the phase-transition picture.

use super::context::{Common, open_folder};
use super::error::CliError;
use super::options::{seed, whole};
use super::progress::Bars;
use clap::{Args, ValueEnum};
use spts_recon::recover::Signs;
use spts_report::phase::write;
use spts_studies::phase::{Method, PhaseStudy, methods};
use std::path::PathBuf;

/// Measures how many samples each recovery algorithm needs for a sparse signal, beside theory: a phase diagram.
///
/// Many random problems are made and solved. A problem has N unknowns, of which S are not zero and have magnitudes of
/// .5 to 1.5, and M noiseless measurements with random weights of ±1. It counts as solved when the answer is within 1 %
/// of the signal. The result is the share of solved problems over M/N (undersampling) and S/M (sparsity), and the S/M
/// at which half of the problems are solved. No skin is simulated: this shows what an algorithm can do at best.
///
/// Two theories for large N are drawn beside the shares. One is the weak threshold of Donoho and Tanner: below it, the
/// smallest sum of magnitudes identifies almost every signal. It predicts nn_lasso. The other is the threshold below
/// which only one non-negative signal fits the measurements. It predicts nn_lmmse. For all other methods both are only
/// a comparison. The methods lmmse and tv are left out, because they do not look for sparse signals.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts phase --quick
  spts phase --method omp,nn_lasso --n 400 --trials 100
  spts phase --signs either --json

Files in DIR:
  rates.csv                 one line a method, M and S: share of the problems that were solved
  crossings.csv             one line a method and M: the S/M at which half are solved, its standard error, and the
                            theory
  phase.json                both
  figures/phase.png         the S/M at which half are solved, over M/N, beside the theory; phase_rates.png all shares,
                            with the theory outlined; .svg the same

For small N, the share falls from 1 to 0 over a range of S/M of about N^(-1/2), a little above the theory. Where it is
zero at two neighbouring S, it is taken as zero for all larger S without a trial.")]
pub(super) struct PhaseCommand {
    /// Recovery algorithms, by the names in docs/decoders.md [default: all that look for sparse signals of these
    /// --signs]
    #[arg(long, value_delimiter = ',', value_name = "NAME,…")]
    method: Vec<String>,
    /// Signs of the coefficients that are not zero; methods whose names begin with nn_ need positive ones
    #[arg(long, value_enum, default_value = "positive")]
    signs: SignsArg,
    /// Number of unknowns N; [20, 2000]
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = whole::<u16>(20..=2000))]
    n: u16,
    /// Number of problems for each pair of M and S; [1, 100000] [default: 30, with --quick 12]
    #[arg(long, value_name = "COUNT", value_parser = whole::<u32>(1..=100_000))]
    trials: Option<u32>,
    /// M/N = .25, .5, .75 and 1 only, and fewer problems
    #[arg(long)]
    quick: bool,
    /// Seed of all problems
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "out/phase")]
    out: PathBuf,
    #[command(flatten)]
    common: Common,
}

/// Signs on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum SignsArg {
    /// All coefficients above zero, as contact is
    Positive,
    /// Above and below zero alike
    Either,
}

impl PhaseCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let out = open_folder(&self.out, spts_report::phase::FILES)?;
        let signs = match self.signs {
            SignsArg::Positive => Signs::Positive,
            SignsArg::Either => Signs::Either,
        };
        let default_trials = if self.quick { 12 } else { 30 };
        let study = PhaseStudy {
            methods: chosen(&self.method, signs)?,
            signs,
            unknowns: usize::from(self.n),
            trials: self.trials.unwrap_or(default_trials) as usize,
            quick: self.quick,
            seed: self.seed,
        };
        let report = study.run(&Bars::default())?;
        write(&report, out)?;
        let picture = self.out.join("figures/phase.png");
        let text = || format!("{}\npicture: {}", report.text().trim_end(), picture.display());
        self.common.print(&report, text)
    }
}

/// The methods with these names, or all.
fn chosen(names: &[String], signs: Signs) -> Result<Vec<Method>, CliError> {
    let known = methods(signs);
    if let Some(unknown) = names.iter().find(|name| known.iter().all(|m| m.name != **name)) {
        let names: Vec<&str> = known.iter().map(|m| m.name).collect();
        return Err(CliError::Usage(format!(
            "`--method` = {unknown}: with these signs, known are {}",
            names.join(", ")
        )));
    }
    let wanted = |method: &Method| names.is_empty() || names.iter().any(|name| name == method.name);
    Ok(known.into_iter().filter(wanted).collect())
}
