//! No simulated sessions, and results without figures.

use crate::error::CliError;
use spts::Session;
use spts::output::OutputFolder;
use spts_eval::anytime::{self, AnytimeBoard};
use spts_eval::board::{self, ScoreBoard};
use spts_eval::decode::{self, DecodedSession};
use spts_eval::in_time::{self, InTimeBoard};
use spts_eval::{ScoredSession, Source};
use spts_input::Refusal;
use spts_models::SkinLayout;

/// Where the commands are that this program lacks.
pub(crate) const COMMANDS_ELSEWHERE: &str = "; this build has decode, score, dataset, device and record; simulate, reproduce, live and the \
     studies are in the program that `make install` makes of the repository";

/// Refuses.
pub(crate) fn simulated_sessions(_: &[String], _: u64, _: bool) -> Result<Source, CliError> {
    Err(CliError::usage(
        "`--twin`: this build has no physics engine; simulate with the program that `cargo build` makes".to_owned(),
    ))
}

/// Refuses.
pub(crate) fn simulated_presses(_: SkinLayout, _: bool, _: u64) -> Result<Vec<ScoredSession>, CliError> {
    Err(CliError::usage(
        "presses cannot be simulated: this build has no physics engine; valid for `--learn-from`: published, raster, or a folder \
         of recordings"
            .to_owned(),
    ))
}

/// Writes the tables of a board.
pub(crate) fn write_board(board: &ScoreBoard, out: OutputFolder) -> Result<(), Refusal> {
    written(out, |out| board::write(board, out))
}

/// Writes the tables of decoders that stop.
pub(crate) fn write_anytime(board: &AnytimeBoard, out: OutputFolder) -> Result<(), Refusal> {
    written(out, |out| anytime::write(board, out))
}

/// Writes the tables of contacts that are followed in time.
pub(crate) fn write_in_time(board: &InTimeBoard, out: OutputFolder) -> Result<(), Refusal> {
    written(out, |out| in_time::write(board, out))
}

/// Writes the table and arrays of decoded sessions.
pub(crate) fn write_decoded(decoded: &[(&Session, DecodedSession)], out: OutputFolder) -> Result<(), Refusal> {
    written(out, |out| decode::write(decoded, out))
}

/// All files or, after an error, none.
fn written(mut out: OutputFolder, write: impl FnOnce(&mut OutputFolder) -> Result<(), Refusal>) -> Result<(), Refusal> {
    write(&mut out).map_err(|error| out.unstaged(error))?;
    out.commit()?;
    Ok(())
}
