//! Recovery against independent programs, exhaustive search and closed forms.

// `cfg(test)` marks the helpers as test code for the lints, too
#[cfg(test)]
mod estimates;
#[cfg(test)]
mod helpers;
#[cfg(test)]
mod pursuits;
#[cfg(test)]
mod robust;
#[cfg(test)]
mod sequential;
