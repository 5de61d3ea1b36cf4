//! Places where points of a file were lost, in bounded memory.

use crate::points::Damage;

/// Each place is told up to this many; the rest are counted together.
const MAX_PLACES: usize = 20;

/// Damages of one file in the sequence they were found.
#[derive(Debug, Clone, Default)]
pub(crate) struct Damages {
    list: Vec<Damage>,
}

impl Damages {
    pub(crate) fn add(&mut self, place: impl Into<String>, problem: impl Into<String>, lost: u64) {
        if self.list.len() <= MAX_PLACES {
            self.list.push(Damage { place: place.into(), problem: problem.into(), lost });
        } else if let Some(last) = self.list.last_mut() {
            if !last.place.ends_with(" and later") {
                last.place.push_str(" and later");
            }
            last.lost += lost;
        }
    }

    pub(crate) fn list(&self) -> &[Damage] {
        &self.list
    }

    /// Points lost altogether.
    pub(crate) fn lost(&self) -> u64 {
        self.list.iter().map(|damage| damage.lost).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_places_are_counted_together() {
        let mut damages = Damages::default();
        (0..1000).for_each(|i| damages.add(format!("line {i}"), "too short", 1));
        assert_eq!((damages.list().len(), damages.lost()), (MAX_PLACES + 1, 1000));
        assert_eq!(damages.list()[MAX_PLACES].place, format!("line {MAX_PLACES} and later"));
    }
}
