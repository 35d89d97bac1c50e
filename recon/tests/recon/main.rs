//! Recovery against independent programs, exhaustive search and closed forms.

// `cfg(test)` marks the helpers as test code for the lints, too
#[cfg(test)]
mod allocation;
#[cfg(test)]
mod convex;
#[cfg(test)]
mod exhaustive;
#[cfg(test)]
mod extremes;
#[cfg(test)]
mod fixed;
#[cfg(test)]
mod phase;
#[cfg(test)]
mod pursuits;
#[cfg(test)]
mod scales;
#[cfg(test)]
mod sequential;
#[cfg(test)]
mod tracked;
