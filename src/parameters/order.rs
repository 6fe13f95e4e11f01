//! The order of lobes that could be exchanged for each other.

use super::row::{ParameterRow, Status};
use super::table::ParameterTable;
use crate::model::Sharper;

impl ParameterTable {
    /// Puts lobes of one kind in order, the sharpest first; returns whether any moved.
    ///
    /// Their sum does not depend on which is which. Only lobes that are alike in everything but their
    /// values are exchanged: one with a value or a bound of its own from the user keeps its place.
    pub fn sort_lobes(&mut self) -> bool {
        let mut moved = false;
        // Every exchange takes one pair out of disorder and brings none into it.
        while let Some((a, b)) = self.disorder() {
            let rows = |lobe: usize| self.places[lobe].concat();
            for (i, j) in rows(a).into_iter().zip(rows(b)) {
                self.exchange(i, j);
            }
            moved = true;
        }
        self.follow();
        moved
    }

    /// Whether lobes of one kind stand in order, the sharpest first.
    #[must_use]
    pub fn is_sorted(&self) -> bool {
        self.disorder().is_none()
    }

    /// Whether some lobes could change places without changing the model.
    #[must_use]
    pub fn has_exchangeable_lobes(&self) -> bool {
        self.pairs().any(|(a, b)| self.exchangeable(a, b))
    }

    /// Two lobes of one kind of which the sharper one comes second.
    fn disorder(&self) -> Option<(usize, usize)> {
        self.pairs().find(|(a, b)| self.out_of_order(*a, *b))
    }

    /// All pairs of lobes, as written.
    fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let count = self.lobes.len();
        (0..count).flat_map(move |a| (a + 1..count).map(move |b| (a, b)))
    }

    /// Exchanges the values of two rows.
    fn exchange(&mut self, i: usize, j: usize) {
        let values = |row: &ParameterRow| (row.value, row.initial);
        let (first, second) = (values(&self.rows[i]), values(&self.rows[j]));
        (self.rows[i].value, self.rows[i].initial) = second;
        (self.rows[j].value, self.rows[j].initial) = first;
    }

    /// Whether lobe `b` is the sharper one of two that may be exchanged.
    fn out_of_order(&self, a: usize, b: usize) -> bool {
        if !self.exchangeable(a, b) {
            return false;
        }
        let key = |lobe: usize| {
            let rows = self.places[lobe].iter().filter_map(|rows| rows.first()).map(|row| &self.rows[*row]);
            rows.filter_map(|row| Some((row.spec.sharper?, row.value))).next()
        };
        match (key(a), key(b)) {
            (Some((Sharper::Smaller, first)), Some((_, second))) => second < first,
            (Some((Sharper::Larger, first)), Some((_, second))) => second > first,
            _ => false,
        }
    }

    /// Whether two lobes are of one kind and the user has not told them apart.
    fn exchangeable(&self, a: usize, b: usize) -> bool {
        if self.kinds[a] != self.kinds[b] {
            return false;
        }
        let rows = |lobe: usize| self.places[lobe].concat();
        let (first, second) = (rows(a), rows(b));
        let alike = |i: usize, j: usize| {
            let (x, y) = (&self.rows[i], &self.rows[j]);
            let same_role = match (x.status, y.status) {
                (Status::Free, Status::Free) => true,
                (Status::Fixed, Status::Fixed) => x.value == y.value,
                // Tied to each other, or each to the same parameter of its own lobe or of a third.
                (Status::Tied(t), _) if t == j => true,
                (_, Status::Tied(t)) if t == i => true,
                (Status::Tied(s), Status::Tied(t)) => {
                    let within = |lobe: &[usize], row: usize| lobe.iter().position(|r| *r == row);
                    s == t || within(&first, s).is_some_and(|at| within(&second, t) == Some(at))
                }
                _ => false,
            };
            same_role && !x.given && !y.given && x.bounds == y.bounds
        };
        first.len() == second.len() && first.iter().zip(&second).all(|(i, j)| alike(*i, *j))
    }
}
