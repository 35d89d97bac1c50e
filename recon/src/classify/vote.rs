//! Majority votes over consecutive decisions.

/// Most frequent label, the lowest of equal ones; `None` without labels. Undecided entries (`None`) do not vote.
///
/// ```
/// use spts_recon::classify::majority;
///
/// assert_eq!(majority(&[Some(3), None, Some(5), Some(5)]), Some(5));
/// assert_eq!(majority(&[None, None]), None);
/// ```
#[must_use]
pub fn majority(decisions: &[Option<usize>]) -> Option<usize> {
    let mut labels: Vec<usize> = decisions.iter().flatten().copied().collect();
    labels.sort_unstable();
    let mut best: Option<(usize, usize)> = None;
    for run in labels.chunk_by(|a, b| a == b) {
        if best.is_none_or(|(_, count)| run.len() > count) {
            best = Some((run[0], run.len()));
        }
    }
    best.map(|(label, _)| label)
}

/// Majority of every complete group of `size` consecutive decisions. The published script never clears its list of
/// decisions between groups; `cumulative` reproduces this, so that each vote counts all decisions so far.
#[must_use]
pub fn vote_groups(decisions: &[Option<usize>], size: usize, cumulative: bool) -> Vec<Option<usize>> {
    (1..=decisions.len() / size.max(1))
        .map(|group| {
            let start = if cumulative { 0 } else { (group - 1) * size };
            majority(&decisions[start..group * size])
        })
        .collect()
}

/// Counts the share of correct decisions over several sequences of windows.
#[derive(Debug, Clone, Copy, Default)]
pub struct VoteScore {
    correct: f64,
    total: f64,
}

impl VoteScore {
    /// Counts `decisions` about an object of class `label`.
    pub fn add(&mut self, decisions: &[Option<usize>], label: usize) {
        for &decision in decisions {
            self.total += 1.0;
            if decision == Some(label) {
                self.correct += 1.0;
            }
        }
    }

    /// Adds the counts of `other`.
    pub fn merge(&mut self, other: Self) {
        self.correct += other.correct;
        self.total += other.total;
    }

    /// Share of correct decisions; `None` without decisions.
    #[must_use]
    pub fn share(&self) -> Option<f64> {
        (self.total > 0.0).then(|| self.correct / self.total)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ties_go_to_the_lowest_label_and_the_undecided_do_not_vote() {
        assert_eq!(majority(&[Some(4), Some(2), Some(4), Some(2), None]), Some(2));
        assert_eq!(majority(&[None, None]), None);
        let decisions = [Some(1), Some(1), Some(2), Some(2), Some(2), Some(9)];
        assert_eq!(vote_groups(&decisions, 2, false), [Some(1), Some(2), Some(2)]);
        assert_eq!(vote_groups(&decisions, 2, true), [Some(1), Some(1), Some(2)]);
        assert_eq!(vote_groups(&decisions[..1], 2, false), []);
    }
}
