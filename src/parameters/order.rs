//! The order of lobes that are interchangeable.

use super::row::{ParameterRow, Status};
use super::table::ParameterTable;
use crate::model::Sharper;

impl ParameterTable {
    /// Puts lobes of one kind in order, the sharpest first, and returns whether any moved.
    ///
    /// Their sum does not depend on their order. Only lobes that differ in nothing but their values are exchanged: a
    /// lobe with a value or a bound of its own from the user keeps its place.
    pub fn sort_lobes(&mut self) -> bool {
        let mut moved = false;
        // Every exchange puts one pair in order and no pair out of order.
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

    /// Whether lobes of one kind are in order, the sharpest first.
    #[must_use]
    pub fn is_sorted(&self) -> bool {
        self.disorder().is_none()
    }

    /// Whether some lobes could be exchanged without changing the model.
    #[must_use]
    pub fn has_exchangeable_lobes(&self) -> bool {
        self.pairs().any(|(a, b)| self.exchangeable(a, b))
    }

    /// Two lobes of one kind of which the sharper one comes second; `None` if there are none.
    fn disorder(&self) -> Option<(usize, usize)> {
        self.pairs().find(|(a, b)| self.out_of_order(*a, *b))
    }

    /// All pairs of lobes, in the order in which they are written.
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

    /// Whether lobes `a` and `b` may be exchanged and `b` is the sharper one.
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

    /// Whether two lobes are of one kind and the user's constraints do not distinguish them.
    pub(super) fn exchangeable(&self, a: usize, b: usize) -> bool {
        if self.kinds[a] != self.kinds[b] {
            return false;
        }
        let rows = |lobe: usize| self.places[lobe].concat();
        let (first, second) = (rows(a), rows(b));
        let alike = |i: usize, j: usize| {
            let (x, y) = (&self.rows[i], &self.rows[j]);
            let same_role = match (x.status, y.status) {
                (Status::Free, Status::Free) | (Status::Apart, Status::Apart) => true,
                (Status::Fixed, Status::Fixed) => x.value == y.value,
                // Tied to each other, or each tied to the same parameter of its own lobe or of a third one.
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
