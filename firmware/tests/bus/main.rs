//! Emulated cells on their bus and clock: whatever a master does, each cell ends where the behavioural cell says it
//! should.

// `cfg(test)` marks the helpers as test code for the lints, too
#[cfg(test)]
mod clock;
#[cfg(test)]
mod helpers;
#[cfg(test)]
mod traffic;
