//! Removes duplicate values.

/// `values` without duplicates, in order of first appearance.
///
/// ```
/// assert_eq!(spts_eval::unique([3, 1, 3, 2, 1]), [3, 1, 2]);
/// ```
pub fn unique<T: PartialEq>(values: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}
