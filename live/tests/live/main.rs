//! The live page without a browser: one skin under requests, and the server asked by real clients.

// `cfg(test)` marks the helpers as test code for the lints, too
#[cfg(test)]
mod server;
#[cfg(test)]
mod session;
