//! Allocates chunks in one vertex buffer of equal pages. A page in use is divided into slots for chunks of one level;
//! an empty page serves any level again.

/// Allocator of chunk slots in a vertex buffer.
pub struct Pool {
    /// Vertices per page.
    page: usize,
    /// Vertices per slot, by level.
    sizes: Vec<usize>,
    pages: Vec<Page>,
    /// Pages that no level uses.
    empty: Vec<u32>,
    /// Pages with a free slot, by level.
    open: Vec<Vec<u32>>,
}

struct Page {
    level: u32,
    /// Slots in use.
    held: usize,
    /// Free slots.
    free: Vec<u32>,
}

/// Chunks of the finest level per page. More of them waste less of a page at other levels.
const CHUNKS: usize = 4;

impl Pool {
    /// Creates a pool for chunks of these sizes by level, largest first, with enough pages for `vertices` vertices.
    pub fn new(sizes: Vec<usize>, vertices: usize) -> Self {
        let page = CHUNKS * sizes[0];
        let count = vertices.div_ceil(page) as u32;
        let pages = (0..count).map(|_| Page { level: 0, held: 0, free: Vec::new() }).collect();
        let open = vec![Vec::new(); sizes.len()];
        Self { page, sizes, pages, empty: (0..count).rev().collect(), open }
    }

    /// Returns the number of vertices of a chunk, by level.
    pub fn sizes(&self) -> &[usize] {
        &self.sizes
    }

    /// Returns the number of vertices of all pages.
    pub fn vertices(&self) -> usize {
        self.pages.len() * self.page
    }

    /// Returns the number of vertices of the pages in use.
    pub fn used_vertices(&self) -> usize {
        (self.pages.len() - self.empty.len()) * self.page
    }

    /// Returns the number of chunks in use.
    pub fn held(&self) -> usize {
        self.pages.iter().map(|page| page.held).sum()
    }

    /// Returns the number of slots of a level in a page.
    fn slots(&self, level: u32) -> usize {
        self.page / self.sizes[level as usize]
    }

    /// Returns the vertices of the pages that hold `chunks` chunks by level. Includes one more page for each level, for
    /// the loss by fragmentation.
    pub fn vertices_for(sizes: &[usize], chunks: &[usize]) -> usize {
        let page = CHUNKS * sizes[0];
        sizes.iter().zip(chunks).map(|(size, chunks)| (chunks.div_ceil(page / size) + 1) * page).sum()
    }

    /// Returns the vertices of a buffer that holds these chunks by level. Includes one more page for each of these
    /// levels, and one page of every level for replaced chunks.
    pub fn settled_vertices(sizes: &[usize], chunks: &[usize]) -> usize {
        let used = chunks.iter().filter(|&&count| count > 0).count();
        Self::vertices_for(sizes, chunks) + used * CHUNKS * sizes[0]
    }

    /// Returns an upper bound on the vertices of pages for `chunks` chunks of any levels, with two more pages for each
    /// level.
    pub fn max_vertices(sizes: &[usize], chunks: usize) -> usize {
        (chunks.div_ceil(CHUNKS) + 3 * sizes.len()) * CHUNKS * sizes[0]
    }

    /// Allocates a slot for a chunk of a level and returns its first vertex. Returns `None` if that needs a new page
    /// and at most `spare` pages are empty.
    pub fn take(&mut self, level: u32, spare: usize) -> Option<u32> {
        if self.open[level as usize].is_empty() {
            if self.empty.len() <= spare {
                return None;
            }
            let page = self.empty.pop()?;
            let slots = self.slots(level) as u32;
            self.pages[page as usize] = Page { level, held: 0, free: (0..slots).rev().collect() };
            self.open[level as usize].push(page);
        }
        let page = *self.open[level as usize].last()?;
        let Page { ref mut held, ref mut free, .. } = self.pages[page as usize];
        let slot = free.pop()?;
        *held += 1;
        if free.is_empty() {
            self.open[level as usize].pop();
        }
        Some(page * self.page as u32 + slot * self.sizes[level as usize] as u32)
    }

    /// Frees a slot that [`Self::take`] returned.
    pub fn give(&mut self, first_vertex: u32) {
        let page = first_vertex / self.page as u32;
        let Page { level, ref mut held, ref mut free } = self.pages[page as usize];
        *held -= 1;
        free.push(first_vertex % self.page as u32 / self.sizes[level as usize] as u32);
        let (held, left) = (*held, free.len());
        let open = &mut self.open[level as usize];
        if left == 1 {
            open.push(page);
        }
        if held == 0 {
            self.open[level as usize].retain(|other| *other != page);
            self.empty.push(page);
        }
    }

    /// Returns true if `chunks` chunks by level can be allocated now, in any order, with `spare` pages left empty.
    pub fn holds(&self, chunks: &[usize], spare: usize) -> bool {
        let pages = |level: usize| {
            let open: usize = self.open[level].iter().map(|page| self.pages[*page as usize].free.len()).sum();
            chunks[level].saturating_sub(open).div_ceil(self.slots(level as u32))
        };
        (0..chunks.len()).map(pages).sum::<usize>() + spare <= self.empty.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_never_overlap_or_leak() {
        let sizes = vec![81, 25, 9, 4];
        let mut pool = Pool::new(sizes.clone(), 20 * 324);
        let (mut held, mut seed, mut refused): (Vec<(u32, u32)>, u32, u32) = (Vec::new(), 1, 0);
        for step in 0..20_000 {
            seed = seed.wrapping_mul(1664525).wrapping_add(1013904223);
            let (choice, at) = (seed >> 24, (seed >> 8) as usize);
            // Phases of filling and emptying alternate.
            let fills = step / 500 % 2 == 0;
            if choice.is_multiple_of(4) != fills || held.is_empty() {
                match pool.take(at as u32 % 4, 0) {
                    Some(first) => held.push((first, at as u32 % 4)),
                    None => refused += 1,
                }
            } else {
                pool.give(held.swap_remove(at % held.len()).0);
            }
            let mut sorted = held.clone();
            sorted.sort_unstable();
            let apart = |pair: &[(u32, u32)]| pair[0].0 + sizes[pair[0].1 as usize] as u32 <= pair[1].0;
            assert!(sorted.windows(2).all(apart), "chunks overlap");
            assert!(sorted.last().is_none_or(|&(first, k)| first as usize + sizes[k as usize] <= pool.vertices()));
        }
        assert_eq!(pool.held(), held.len());
        assert!(refused > 300, "it was full {refused} times only");
        while pool.take(0, 0).is_some() {}
        assert!(pool.take(0, 0).is_none() && !pool.holds(&[1, 0, 0, 0], 0), "it is full");
        let mut pool = Pool::new(sizes, 20 * 324);
        let all: Vec<u32> = std::iter::from_fn(|| pool.take(1, 3)).collect();
        assert_eq!((all.len(), pool.used_vertices()), (17 * 12, 17 * 324), "all but the spare pages");
        assert!(pool.holds(&[12, 0, 0, 0], 0) && !pool.holds(&[13, 0, 0, 0], 0) && pool.holds(&[4, 1, 0, 0], 1));
        all.into_iter().for_each(|first| pool.give(first));
        assert_eq!(pool.used_vertices(), 0);
    }
}
