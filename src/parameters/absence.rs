//! Lobes that are absent, and the smaller sums that remain without them.
//!
//! The strength of a lobe with a Fresnel term is 1 in the physical model, so that F0 has its meaning. At that strength
//! the lobe cannot vanish, because a Fresnel term still rises towards grazing at f0 = 0. A fit therefore chooses
//! between a strength of 1 and a strength of 0. With two or more such lobes in a sum physics says no more about the share of
//! each: their strengths are free.

use super::row::Status;
use super::table::ParameterTable;
use crate::model::{Role, Strength};

/// A table without one of its lobes.
pub(crate) struct Smaller {
    /// The table.
    pub(crate) table: ParameterTable,
    /// The row of the whole table that each of its rows comes from.
    pub(crate) origins: Vec<usize>,
}

impl ParameterTable {
    /// Whether a lobe is absent.
    #[must_use]
    pub fn is_absent(&self, lobe: usize) -> bool {
        self.places[lobe].iter().flatten().any(|row| self.rows[*row].status == Status::Absent)
    }

    /// The rows of the amplitude that scales a lobe and that is 1 in the physical model; none if it has no such amplitude.
    pub(crate) fn scales(&self, lobe: usize) -> Vec<usize> {
        let Strength::Scale(name) = self.strengths[lobe] else { return Vec::new() };
        (0..self.rows.len())
            .filter(|row| (self.rows[*row].lobe, self.rows[*row].spec.name) == (lobe, name))
            .collect()
    }

    /// The lobes that reflect at a surface and whose strength is 1 in the physical model.
    fn surfaces(&self) -> Vec<usize> {
        (0..self.lobes.len())
            .filter(|lobe| self.has_width(*lobe) && matches!(self.strengths[*lobe], Strength::Scale(_)))
            .collect()
    }

    /// Frees the strengths of lobes that reflect at a surface if there are several.
    pub(super) fn free_scales_of_several(&mut self) {
        let surfaces = self.surfaces();
        if surfaces.len() < 2 {
            return;
        }
        for row in surfaces.into_iter().flat_map(|lobe| self.scales(lobe)).collect::<Vec<_>>() {
            let row = &mut self.rows[row];
            row.spec.fixed = false;
            row.status = Status::Free;
        }
    }

    /// Whether a parameter of another lobe is tied to one of this lobe.
    fn has_followers(&self, lobe: usize) -> bool {
        let follows = |status| matches!(status, Status::Tied(to) if self.rows[to].lobe == lobe);
        self.rows.iter().any(|row| row.lobe != lobe && follows(row.status))
    }

    /// The rows that must be 0 for a lobe to be absent; `None` if the user's constraints or ties do not let them.
    fn switches(&self, lobe: usize) -> Option<Vec<usize>> {
        if self.has_followers(lobe) {
            return None;
        }
        let counts = |row: &usize| {
            let spec = &self.rows[*row].spec;
            match self.strengths[lobe] {
                Strength::Amplitudes => spec.role == Role::Amplitude && !spec.fixed,
                Strength::Shape(name) | Strength::Scale(name) => spec.name == name,
                Strength::Missing => false,
            }
        };
        let switches: Vec<usize> = self.places[lobe].concat().into_iter().filter(counts).collect();
        let may_vanish = |row: &usize| {
            let row = &self.rows[*row];
            let fitted = match row.status {
                Status::Free | Status::Apart => true,
                Status::Fixed => matches!(self.strengths[lobe], Strength::Scale(_)) && !row.given,
                Status::Tied(to) => self.rows[to].lobe == lobe,
                Status::Absent => false,
            };
            fitted && row.bounds.0 == 0.0
        };
        (!switches.is_empty() && switches.iter().all(may_vanish)).then_some(switches)
    }

    /// Whether the fit moves a shape of a lobe.
    pub(crate) fn has_free_shapes(&self, lobe: usize) -> bool {
        let mut own = self.rows.iter().filter(|row| row.lobe == lobe);
        own.any(|row| row.spec.role == Role::Shape && row.status == Status::Free)
    }

    /// Whether both factors of some product are free.
    pub(crate) fn has_free_products(&self) -> bool {
        let is_free = |lobe: usize, parameter: usize| {
            self.places[lobe][parameter].iter().any(|row| self.rows[*row].status == Status::Free)
        };
        self.products
            .iter()
            .any(|product| is_free(product.lobe, product.first) && is_free(product.lobe, product.second))
    }

    /// The places among the free parameters of both factors of each product, by channel, where each factor has a value of its own.
    pub(crate) fn free_products(&self) -> Vec<(usize, usize)> {
        let mut pairs: Vec<(usize, usize)> = Vec::new();
        for product in &self.products {
            let [first, second] =
                [product.first, product.second].map(|parameter| &self.places[product.lobe][parameter]);
            if first.len() == second.len() {
                let place = |row: &usize| self.free.binary_search(row).ok();
                pairs.extend(first.iter().zip(second).filter_map(|(a, b)| Some((place(a)?, place(b)?))));
            }
        }
        // What another row follows is not changed by its own lobe alone.
        let is_followed = |column: usize| {
            let index = self.free[column];
            self.rows.iter().any(|row| row.status == Status::Tied(index))
        };
        pairs.retain(|(a, b)| !is_followed(*a) && !is_followed(*b));
        pairs
    }

    /// Whether the fit can take the strength of a lobe to 0 by small steps.
    pub(crate) fn vanishes_gradually(&self, lobe: usize) -> bool {
        let scales = self.scales(lobe);
        scales.is_empty() || scales.iter().any(|row| self.rows[*row].status == Status::Free)
    }

    /// The lobes without which the sum could be fitted, of lobes that may be exchanged only the last.
    pub(crate) fn removable(&self) -> Vec<usize> {
        let count = self.lobes.len();
        let last_of_its_kind = |lobe: &usize| (lobe + 1..count).all(|other| !self.exchangeable(*lobe, other));
        let lobes = (0..count).filter(|lobe| !self.is_absent(*lobe) && self.switches(*lobe).is_some());
        lobes.filter(last_of_its_kind).collect()
    }

    /// The table of the sum without a lobe. If one lobe is left that reflects at a surface, its strength is 1.
    pub(crate) fn without(&self, lobe: usize) -> Smaller {
        let origins: Vec<usize> = (0..self.rows.len()).filter(|row| self.rows[*row].lobe != lobe).collect();
        let place = |row: usize| origins.binary_search(&row).ok();
        let mut table = self.clone();
        table.lobes.remove(lobe);
        table.kinds.remove(lobe);
        table.places.remove(lobe);
        table.strengths.remove(lobe);
        table.products.retain(|product| product.lobe != lobe);
        table.products.iter_mut().filter(|product| product.lobe > lobe).for_each(|product| product.lobe -= 1);
        for row in table.places.iter_mut().flatten().flatten() {
            *row = place(*row).unwrap_or_default();
        }
        table.rows = origins.iter().map(|row| self.rows[*row].clone()).collect();
        for row in &mut table.rows {
            row.lobe -= usize::from(row.lobe > lobe);
            if let Status::Tied(to) = row.status {
                row.status = place(to).map_or(Status::Free, Status::Tied);
            }
        }
        if let [only] = table.surfaces()[..] {
            for row in table.scales(only) {
                let row = &mut table.rows[row];
                let is_fitted = matches!(row.status, Status::Free | Status::Apart);
                if is_fitted && !row.given && !row.spec.fixed {
                    (row.status, row.value, row.initial) =
                        (Status::Fixed, row.spec.initial, row.spec.initial);
                    row.spec.fixed = true;
                }
            }
        }
        table.list_free();
        Smaller { table, origins }
    }

    /// This table with the values of a `smaller` one, and without any trace of the lobe that the smaller one lacks.
    /// If the lobe's strength is free, it is 0 and remains free; otherwise the lobe is absent.
    pub(crate) fn with_values_of(&self, smaller: &Smaller, lobe: usize) -> Self {
        let mut table = self.clone();
        for (row, origin) in smaller.table.rows.iter().zip(&smaller.origins) {
            let target = &mut table.rows[*origin];
            (target.value, target.initial) = (row.value, row.initial);
            if row.status == Status::Absent {
                target.status = Status::Absent;
            }
        }
        let switches = self.switches(lobe).unwrap_or_default();
        if switches.iter().any(|row| self.rows[*row].status == Status::Fixed) {
            table.set_absent(lobe);
        } else {
            switches.into_iter().for_each(|row| table.rows[row].value = 0.0);
            table.list_free();
            table.follow();
        }
        table
    }

    /// Makes a lobe absent: its strength is 0, and its other parameters keep the values that they started from.
    fn set_absent(&mut self, lobe: usize) {
        for row in self.rows.iter_mut().filter(|row| row.lobe == lobe) {
            row.status = Status::Absent;
            row.value = row.initial;
        }
        self.scales(lobe).into_iter().for_each(|row| self.rows[row].value = 0.0);
        self.list_free();
        self.follow();
    }

    /// Makes those lobes absent whose scale is fitted and has become 0 in every channel. Returns whether there are any.
    pub(crate) fn drop_absent_lobes(&mut self) -> bool {
        let mut any = false;
        for lobe in 0..self.lobes.len() {
            let scales = self.scales(lobe);
            let gone = |row: &usize| {
                let row = &self.rows[*row];
                row.status == Status::Apart || (row.status == Status::Free && row.value == 0.0)
            };
            let may_vanish = !scales.is_empty() && !self.has_followers(lobe) && self.lobes.len() > 1;
            if may_vanish && scales.iter().all(gone) {
                self.set_absent(lobe);
                any = true;
            }
        }
        any
    }
}
