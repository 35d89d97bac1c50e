//! Divides the files of a data set among workers.

use crate::error::DatasetError;

/// A worker's part: the files k with k mod `of` = `worker`. The set of files does not depend on it.
///
/// ```
/// use spts_dataset::Part;
///
/// let part = Part::parse("1/4")?;
/// assert_eq!(part.shards(10).collect::<Vec<_>>(), [1, 5, 9]);
/// # Ok::<(), spts_dataset::DatasetError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Number of this worker, from 0.
    pub worker: u64,
    /// Number of workers.
    pub of: u64,
}

/// Variables of Slurm's job arrays and of Kubernetes' indexed jobs.
const SLURM: [&str; 3] = ["SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_COUNT"];
const KUBERNETES: &str = "JOB_COMPLETION_INDEX";

impl Part {
    /// The part of a single worker: all files.
    pub const WHOLE: Self = Self { worker: 0, of: 1 };

    /// Reads the text "i/n": worker i of n, counted from 0.
    ///
    /// # Errors
    /// [`DatasetError::Part`] if the text is not a valid part.
    pub fn parse(text: &str) -> Result<Self, DatasetError> {
        let numbers = text
            .split_once('/')
            .and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match numbers {
            Some((worker, of)) if worker < of => Ok(Self { worker, of }),
            _ => Err(DatasetError::Part(format!(
                "`--shard` = {}: valid: i/n with whole numbers 0 ≤ i < n",
                text.escape_debug()
            ))),
        }
    }

    /// The part of this worker, found with `variable`, which reads environment variables. In a Slurm array: the task's
    /// number minus the array's first, out of the number of tasks. In a Kubernetes indexed job: the job's index, out of
    /// `workers`. `None` outside of both.
    ///
    /// # Errors
    /// [`DatasetError::Part`] if a variable is missing or not a number, or the worker is out of range.
    pub fn from_environment(
        variable: impl Fn(&str) -> Option<String>,
        workers: Option<u64>,
    ) -> Result<Option<Self>, DatasetError> {
        let number = |name: &str| -> Result<Option<u64>, DatasetError> {
            let Some(text) = variable(name) else { return Ok(None) };
            let number = text.trim().parse().map(Some);
            number
                .map_err(|_| DatasetError::Part(format!("{name} = {}: a whole number is needed", text.escape_debug())))
        };
        let [task, first, tasks] = SLURM;
        let (worker, of, name) = if let Some(task_number) = number(task)? {
            let first_number = number(first)?.unwrap_or(0);
            let worker = task_number.checked_sub(first_number);
            let worker = worker.ok_or_else(|| {
                DatasetError::Part(format!("{task} = {task_number} is below {first} = {first_number}"))
            })?;
            let count = number(tasks)?;
            (worker, count.or(workers), tasks)
        } else if let Some(index) = number(KUBERNETES)? {
            (index, workers, "`--shards`")
        } else {
            return Ok(None);
        };
        let Some(of) = of else {
            return Err(DatasetError::Part(format!(
                "{name} is needed beside worker number {worker}"
            )));
        };
        if worker >= of {
            return Err(DatasetError::Part(format!(
                "worker number {worker} is not one of {of}, which count from 0"
            )));
        }
        Ok(Some(Self { worker, of }))
    }

    /// Numbers of the files that this worker makes, of the `shards` files of the data set, counted from 0.
    pub fn shards(self, shards: u64) -> impl Iterator<Item = u64> {
        (self.worker..shards).step_by(usize::try_from(self.of).unwrap_or(usize::MAX))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn workers_share_all_files() {
        for of in 1..6 {
            let mut all: Vec<u64> = (0..of).flat_map(|worker| Part { worker, of }.shards(17)).collect();
            all.sort_unstable();
            assert_eq!(all, (0..17).collect::<Vec<_>>());
        }
        for bad in ["", "1", "4/4", "-1/4", "a/b", "1/0", "1/4/2", "1.0/4"] {
            assert!(Part::parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn clusters_tell_their_workers() {
        let part = |variables: &[(&str, &str)], workers| {
            let variables: BTreeMap<_, _> = variables.iter().copied().collect();
            Part::from_environment(|name| variables.get(name).map(|v| (*v).to_owned()), workers)
                .map_err(|e| e.to_string())
        };
        let slurm = |id| {
            vec![
                ("SLURM_ARRAY_TASK_ID", id),
                ("SLURM_ARRAY_TASK_MIN", "3"),
                ("SLURM_ARRAY_TASK_COUNT", "4"),
            ]
        };
        assert_eq!(part(&[], None), Ok(None));
        assert_eq!(part(&slurm("3"), None), Ok(Some(Part { worker: 0, of: 4 })));
        assert_eq!(part(&slurm("6"), None), Ok(Some(Part { worker: 3, of: 4 })));
        assert!(part(&slurm("7"), None).unwrap_err().contains("is not one of 4"));
        assert!(part(&slurm("2"), None).unwrap_err().contains("is below"));
        assert!(part(&slurm("x"), None).unwrap_err().contains("a whole number"));
        let kubernetes = [("JOB_COMPLETION_INDEX", "2")];
        assert_eq!(part(&kubernetes, Some(8)), Ok(Some(Part { worker: 2, of: 8 })));
        assert!(part(&kubernetes, None).unwrap_err().contains("`--shards` is needed"));
    }
}
