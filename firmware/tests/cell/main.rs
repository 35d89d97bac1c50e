//! The flash images of the cell: built from their source, and run beside the behavioural cell.

// `cfg(test)` marks the helpers as test code for the lints, too
#[cfg(test)]
mod build;
#[cfg(test)]
mod bus;
#[cfg(test)]
mod conformance;
#[cfg(test)]
mod mutations;
#[cfg(test)]
mod timing;
