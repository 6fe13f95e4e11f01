//! Parameters of channels that are dead, which are fitted to their channel after the others.

use super::row::Status;
use super::table::ParameterTable;
use crate::model::Role;

impl ParameterTable {
    /// Sets the parameters of dead channels apart: amplitudes are fitted after the others, and shapes keep their values. A parameter that
    /// one of another channel is tied to stays.
    pub(crate) fn set_apart(&mut self, dead: &[bool]) {
        assert_eq!(dead.len(), self.channels.len(), "a flag per channel");
        self.dead = dead.to_vec();
        for index in (0..self.rows.len()).filter(|index| self.is_of_dead_channel(*index)).collect::<Vec<_>>()
        {
            let follows = |other: &usize| self.rows[*other].status == Status::Tied(index);
            let is_followed =
                (0..self.rows.len()).filter(follows).any(|other| !self.is_of_dead_channel(other));
            let row = &mut self.rows[index];
            if row.status == Status::Free && !is_followed {
                row.status = if row.spec.role == Role::Amplitude { Status::Apart } else { Status::Fixed };
            }
        }
        self.list_free();
    }

    /// Whether the parameter in a row is that of a dead channel.
    pub(super) fn is_of_dead_channel(&self, index: usize) -> bool {
        self.rows[index].channel.is_some_and(|channel| self.dead[channel])
    }

    /// This table with only those parameters free that were set apart; `None` if there are none.
    pub(crate) fn only_apart(&self) -> Option<Self> {
        let mut table = self.clone();
        for row in &mut table.rows {
            row.status = match row.status {
                Status::Apart => Status::Free,
                Status::Free => Status::Fixed,
                other => other,
            };
        }
        table.list_free();
        (!table.free.is_empty()).then_some(table)
    }

    /// This table with the parameters free that were set apart, for data in which no channel is dead.
    pub(crate) fn rejoined(&self) -> Self {
        let mut table = self.clone();
        table
            .rows
            .iter_mut()
            .filter(|row| row.status == Status::Apart)
            .for_each(|row| row.status = Status::Free);
        table.dead.fill(false);
        table.list_free();
        table
    }

    /// Takes over the values of the parameters that were set apart from `other`, which has the same rows.
    pub(crate) fn take_apart_values(&mut self, other: &Self) {
        for (row, found) in self.rows.iter_mut().zip(&other.rows) {
            if row.status == Status::Apart {
                row.value = found.value;
            }
        }
        self.follow();
    }
}
