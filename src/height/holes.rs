//! Samples without data.

/// Samples without data, one bit each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Holes {
    words: Vec<u64>,
    count: u64,
}

impl Holes {
    /// No hole among `len` samples.
    pub fn none(len: usize) -> Self {
        Self { words: vec![0; len.div_ceil(64)], count: 0 }
    }

    /// Makes sample `k` a hole.
    pub fn insert(&mut self, k: usize) {
        let bit = 1 << (k % 64);
        self.count += u64::from(self.words[k / 64] & bit == 0);
        self.words[k / 64] |= bit;
    }

    /// Returns true if sample `k` is a hole.
    #[inline]
    pub fn contains(&self, k: usize) -> bool {
        self.words[k / 64] >> (k % 64) & 1 != 0
    }

    /// One bit a sample.
    pub fn words(&self) -> &[u64] {
        &self.words
    }

    /// The number of holes.
    pub fn count(&self) -> u64 {
        self.count
    }
}
