//! What commands do more of with the physics engine and the figures built in, and how they do without.

#[cfg(feature = "full")]
mod full;
#[cfg(not(feature = "full"))]
mod without;

#[cfg(feature = "full")]
pub(super) use full::{
    COMMANDS_ELSEWHERE, DECODE_FILES, simulated_presses, simulated_sessions, write_anytime, write_board, write_decoded,
    write_in_time,
};
#[cfg(not(feature = "full"))]
pub(super) use without::{
    COMMANDS_ELSEWHERE, DECODE_FILES, simulated_presses, simulated_sessions, write_anytime, write_board, write_decoded,
    write_in_time,
};
