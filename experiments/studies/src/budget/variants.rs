//! The chains that are compared.

use super::items::{BudgetItem, CONTACT, stages};
use serde::Serialize;

/// How the cost of an effect is found: by taking it out of the whole chain, or by adding it to the ideal one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// The chain without the effect, compared with the whole chain: a positive change is the cost of the effect.
    Ablation,
    /// The ideal chain with the effect, compared with the ideal chain: a negative change is the cost of the effect.
    Addition,
}

impl Direction {
    /// Name in the tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Ablation => "ablation",
            Self::Addition => "addition",
        }
    }
}

/// Name of the row for a whole stage.
pub const WHOLE_STAGE: &str = "whole_stage";
/// Name of the line of the contact model.
pub(super) const LAYER: &str = "layer";

/// A chain: the contact model, and which of the items act.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Variant {
    /// Whether the foam is an elastic layer instead of columns.
    pub(super) layer: bool,
    /// Which items are active.
    pub(super) acts: Vec<bool>,
}

/// One line of the budget: `variant` less `reference`, by their places in the list of variants.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ChainComparison {
    pub(super) stage: &'static str,
    pub(super) effect: &'static str,
    pub(super) mode: Direction,
    pub(super) reference: usize,
    pub(super) variant: usize,
}

/// Every chain that is scored, each once, and what is compared.
#[derive(Debug, Clone)]
pub(super) struct Variants {
    pub(super) list: Vec<Variant>,
    pub(super) comparisons: Vec<ChainComparison>,
}

/// Place of the whole chain in the list.
pub(super) const EVERYTHING: usize = 0;
/// Place of the ideal chain in the list: the transducer's static law alone, and y = Φx.
pub(super) const IDEAL: usize = 1;

impl Variants {
    /// Ablation and addition of every item and of every stage; the contact model is exchanged in the whole chain.
    pub(super) fn new(items: &[BudgetItem]) -> Self {
        let chain = |layer: bool, acts: &dyn Fn(&BudgetItem) -> bool| Variant {
            layer,
            acts: items.iter().map(acts).collect(),
        };
        let mut all = Self {
            list: vec![chain(false, &|_| true), chain(false, &|_| false)],
            comparisons: Vec::new(),
        };
        let whole = |layer| chain(layer, &|_| true);
        all.compare(CONTACT, LAYER, Direction::Ablation, EVERYTHING, whole(true));
        for stage in stages(items) {
            let of_stage = |i: &BudgetItem| i.stage == stage;
            all.compare_both(stage, WHOLE_STAGE, &|chosen| chain(false, &|i| of_stage(i) == chosen));
            for item in items.iter().filter(|i| of_stage(i)) {
                all.compare_both(stage, item.name, &|chosen| chain(false, &|i| (i == item) == chosen));
            }
        }
        all
    }

    /// `with(false)` is the chain without what is looked at, `with(true)` the chain of that alone.
    fn compare_both(&mut self, stage: &'static str, effect: &'static str, with: &dyn Fn(bool) -> Variant) {
        self.compare(stage, effect, Direction::Ablation, EVERYTHING, with(false));
        self.compare(stage, effect, Direction::Addition, IDEAL, with(true));
    }

    fn compare(
        &mut self,
        stage: &'static str,
        effect: &'static str,
        mode: Direction,
        reference: usize,
        variant: Variant,
    ) {
        let found = self.list.iter().position(|v| *v == variant);
        let variant = found.unwrap_or_else(|| {
            self.list.push(variant);
            self.list.len() - 1
        });
        self.comparisons.push(ChainComparison {
            stage,
            effect,
            mode,
            reference,
            variant,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two stages with two items and one: 1 exchange of the contact, 2 × (2 stages + 3 items) comparisons. A stage of
    /// one item is that item: chains all, none, layer, 2 × (first stage + 3 items).
    #[test]
    fn every_chain_is_scored_once() {
        let item = |stage, name| BudgetItem { stage, name };
        let items = [item("a", "x"), item("a", "y"), item("b", "z")];
        let variants = Variants::new(&items);
        assert_eq!(variants.comparisons.len(), 1 + 2 * 5);
        // all less the first stage is the second stage alone, and the other way round
        assert_eq!(variants.list.len(), 3 + 2 + 3 + 3 - 2);
        let line = |effect, mode| {
            let found = |c: &&ChainComparison| c.effect == effect && c.mode == mode;
            let line = variants.comparisons.iter().find(found).unwrap();
            (line.reference, variants.list[line.variant].acts.clone())
        };
        assert_eq!(line("y", Direction::Ablation), (EVERYTHING, vec![true, false, true]));
        assert_eq!(line("y", Direction::Addition), (IDEAL, vec![false, true, false]));
    }
}
