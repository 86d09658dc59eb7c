//! A set of features, by their numbers, that are kept or omitted by hand.

/// The set of forced features; empty by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Forced {
    /// Bit k: feature k of [`FEATURES`](super::FEATURES) is kept.
    kept: u32,
    /// Bit k: feature k is omitted.
    left_out: u32,
}

impl Forced {
    /// Returns the set with feature `k` kept or omitted; `None` if it is forced already.
    pub(super) fn and(self, k: usize, keep: bool) -> Option<Self> {
        let bit = 1 << k;
        let forced =
            if keep { Self { kept: self.kept | bit, ..self } } else { Self { left_out: self.left_out | bit, ..self } };
        self.state(k).is_none().then_some(forced)
    }

    /// Returns true if feature `k` is kept, false if it is omitted, and `None` if it is not forced.
    pub(super) fn state(self, k: usize) -> Option<bool> {
        let is = |bits: u32| bits >> k & 1 == 1;
        if is(self.kept) { Some(true) } else { is(self.left_out).then_some(false) }
    }
}
