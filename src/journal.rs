//! What a job has made so far, block by block, so that a killed one goes on instead of beginning
//! anew.
//!
//! ```text
//! phase  →  values in blocks  →  each block's bytes, once it is made  →  file, now and then
//! file   →  the same phases in the same order  →  blocks that are there are not made again
//! ```
//! A job is a fixed sequence of phases, and each phase a map from numbers to values that depends on
//! nothing else. So whoever runs the same job again, with the blocks of the first run at hand, gets
//! the same bits, whatever moment the first one ended at. A block is known by the name of its
//! phase, by how many phases of this name came before, and by its number.
//!
//! [`crate::run::Run::blocks`] makes values so; where a run has no journal it costs nothing.
//! [`Stored`] turns values into bytes, bit for bit.
//!
//! Guarantees  blocks that were cut short by cancelling are not kept. The same bits for any number
//!             of threads, killed or not. Writing is done by one thread while others go on; a file
//!             that cannot be written is told once and does not stop the job.
//! Not         phases that do not say what they make here: they are made again.
//! Cost        the bytes of all values, in memory and in the file.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use glam::Vec3;

/// Values that become bytes and come back bit for bit.
pub trait Stored: Sized {
    /// Appends its bytes.
    fn put(&self, out: &mut Vec<u8>);
    /// Takes them off the front; none where they do not suffice.
    fn take(from: &mut &[u8]) -> Option<Self>;
}

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl Stored for $number {
            fn put(&self, out: &mut Vec<u8>) {
                out.extend(self.to_le_bytes());
            }
            fn take(from: &mut &[u8]) -> Option<Self> {
                let (bytes, rest) = from.split_first_chunk()?;
                *from = rest;
                Some(Self::from_le_bytes(*bytes))
            }
        }
    )*};
}
numbers!(u8, u32, u64, f32);

impl Stored for Vec3 {
    fn put(&self, out: &mut Vec<u8>) {
        self.to_array().put(out);
    }
    fn take(from: &mut &[u8]) -> Option<Self> {
        <[f32; 3]>::take(from).map(Self::from_array)
    }
}

impl<T: Stored, const N: usize> Stored for [T; N] {
    fn put(&self, out: &mut Vec<u8>) {
        self.iter().for_each(|value| value.put(out));
    }
    fn take(from: &mut &[u8]) -> Option<Self> {
        let values: Vec<T> = (0..N).map(|_| T::take(from)).collect::<Option<_>>()?;
        values.try_into().ok()
    }
}

impl<T: Stored> Stored for Option<T> {
    fn put(&self, out: &mut Vec<u8>) {
        u8::from(self.is_some()).put(out);
        self.iter().for_each(|value| value.put(out));
    }
    fn take(from: &mut &[u8]) -> Option<Self> {
        Some(if u8::take(from)? == 0 { None } else { Some(T::take(from)?) })
    }
}

impl<T: Stored> Stored for Vec<T> {
    fn put(&self, out: &mut Vec<u8>) {
        (self.len() as u64).put(out);
        self.iter().for_each(|value| value.put(out));
    }
    fn take(from: &mut &[u8]) -> Option<Self> {
        (0..u64::take(from)?).map(|_| T::take(from)).collect()
    }
}

impl<A: Stored, B: Stored> Stored for (A, B) {
    fn put(&self, out: &mut Vec<u8>) {
        self.0.put(out);
        self.1.put(out);
    }
    fn take(from: &mut &[u8]) -> Option<Self> {
        Some((A::take(from)?, B::take(from)?))
    }
}

/// Makes a struct [`Stored`]: all its fields, in this order.
macro_rules! stored {
    ($type:ty { $($field:ident),* $(,)? }) => {
        impl $crate::journal::Stored for $type {
            fn put(&self, out: &mut Vec<u8>) {
                $($crate::journal::Stored::put(&self.$field, out);)*
            }
            fn take(from: &mut &[u8]) -> Option<Self> {
                Some(Self { $($field: $crate::journal::Stored::take(from)?),* })
            }
        }
    };
}
pub(crate) use stored;

/// Name of a phase, how many of this name came before it, number of the block.
type Place = (String, u32, u32);

/// The blocks of a job.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Blocks(BTreeMap<Place, Arc<[u8]>>);

impl Blocks {
    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All of them in a row.
    pub fn bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        for ((name, before, number), content) in &self.0 {
            (name.len() as u32).put(&mut out);
            out.extend(name.as_bytes());
            [*before, *number].put(&mut out);
            (content.len() as u64).put(&mut out);
            out.extend(&content[..]);
        }
        out
    }

    /// What [`Self::bytes`] gave; none where they are of something else.
    pub fn from_bytes(mut from: &[u8]) -> Option<Self> {
        let mut blocks = BTreeMap::new();
        while !from.is_empty() {
            let length = u32::take(&mut from)? as usize;
            let (name, rest) = from.split_at_checked(length)?;
            let name = std::str::from_utf8(name).ok()?.to_owned();
            from = rest;
            let [before, number] = <[u32; 2]>::take(&mut from)?;
            let length = usize::try_from(u64::take(&mut from)?).ok()?;
            let (content, rest) = from.split_at_checked(length)?;
            blocks.insert((name, before, number), content.into());
            from = rest;
        }
        Some(Self(blocks))
    }
}

/// Writes what is there; says what is in the way.
pub type Write = dyn Fn(&Blocks) -> std::result::Result<(), String> + Send + Sync;

/// The blocks of a running job, and when they are written next.
pub struct Journal {
    blocks: Mutex<Blocks>,
    /// Phases begun, by name.
    begun: Mutex<BTreeMap<String, u32>>,
    write: Box<Write>,
    every: Duration,
    /// None while somebody writes.
    next: Mutex<Option<Instant>>,
}

impl std::fmt::Debug for Journal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Journal").field("every", &self.every).finish_non_exhaustive()
    }
}

impl Journal {
    /// One that has the blocks of an earlier run, and writes all it has whenever so much time has
    /// passed.
    pub fn new(blocks: Blocks, every: Duration, write: Box<Write>) -> Self {
        let next = Mutex::new(Instant::now().checked_add(every));
        Self { blocks: Mutex::new(blocks), begun: Mutex::default(), write, every, next }
    }

    /// A phase begins: how many of its name came before.
    pub(crate) fn begin(&self, name: &str) -> u32 {
        let mut begun = self.begun.lock().unwrap_or_else(PoisonError::into_inner);
        let count = begun.entry(name.to_owned()).or_default();
        *count += 1;
        *count - 1
    }

    /// A block of an earlier run.
    pub(crate) fn find<T: Stored>(&self, name: &str, before: u32, number: u32) -> Option<T> {
        let place = (name.to_owned(), before, number);
        let blocks = self.blocks.lock().unwrap_or_else(PoisonError::into_inner);
        let content = Arc::clone(blocks.0.get(&place)?);
        drop(blocks);
        let mut from = &content[..];
        T::take(&mut from).filter(|_| from.is_empty())
    }

    /// Keeps a block; writes all that is there if it is time. Gives what was in the way.
    pub(crate) fn keep<T: Stored>(
        &self,
        (name, before, number): (&str, u32, u32),
        value: &T,
    ) -> std::result::Result<(), String> {
        let mut content = Vec::new();
        value.put(&mut content);
        let place = (name.to_owned(), before, number);
        let mut blocks = self.blocks.lock().unwrap_or_else(PoisonError::into_inner);
        blocks.0.insert(place, content.into());
        drop(blocks);
        let mut next = self.next.lock().unwrap_or_else(PoisonError::into_inner);
        if next.is_none_or(|at| Instant::now() < at) {
            return Ok(());
        }
        *next = None;
        drop(next);
        let written = self.write();
        *self.next.lock().unwrap_or_else(PoisonError::into_inner) =
            Instant::now().checked_add(self.every);
        written
    }

    /// Writes all that is there.
    ///
    /// # Errors
    /// What is in the way, in words.
    pub fn write(&self) -> std::result::Result<(), String> {
        let blocks = self.blocks.lock().unwrap_or_else(PoisonError::into_inner).clone();
        (self.write)(&blocks)
    }

    /// Whether nothing is kept yet.
    pub fn is_empty(&self) -> bool {
        self.blocks.lock().unwrap_or_else(PoisonError::into_inner).is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn there_and_back<T: Stored + PartialEq + std::fmt::Debug>(value: T) {
        let mut bytes = Vec::new();
        value.put(&mut bytes);
        let mut from = &bytes[..];
        assert_eq!(T::take(&mut from).as_ref(), Some(&value));
        assert!(from.is_empty());
        for cut in 0..bytes.len() {
            assert_eq!(T::take(&mut &bytes[..cut]), None, "{cut} bytes suffice for {value:?}");
        }
    }

    #[test]
    fn values_come_back_bit_for_bit() {
        there_and_back(f32::MIN_POSITIVE / 3.0);
        there_and_back((7u32, [1.5f32, -0.0]));
        there_and_back(Some(Vec3::new(1.0, f32::INFINITY, -2.0)));
        there_and_back(None::<u64>.map_or(Some(u64::MAX), Some));
        there_and_back(vec![(1u8, Some(2u32)), (3, None)]);
        let mut bytes = Vec::new();
        f32::from_bits(0x7fa1_2345).put(&mut bytes);
        assert_eq!(f32::take(&mut &bytes[..]).map(f32::to_bits), Some(0x7fa1_2345));
        assert_eq!(Vec::<f32>::take(&mut &[255; 12][..]), None, "a length that nothing has");
    }

    #[test]
    fn blocks_come_back_and_others_are_refused() {
        let journal = Journal::new(Blocks::default(), Duration::MAX, Box::new(|_| Ok(())));
        assert!(journal.is_empty());
        let before = journal.begin("sample");
        journal.keep(("sample", before, 3), &vec![1.0f32, 2.0]).unwrap();
        assert_eq!((journal.begin("sample"), journal.begin("record")), (1, 0));
        let blocks = journal.blocks.lock().unwrap().clone();
        let bytes = blocks.bytes();
        assert_eq!(Blocks::from_bytes(&bytes), Some(blocks.clone()));
        for cut in 1..bytes.len() {
            assert_eq!(Blocks::from_bytes(&bytes[..cut]), None, "{cut}");
        }
        let again = Journal::new(blocks, Duration::MAX, Box::new(|_| Ok(())));
        assert_eq!(again.find("sample", 0, 3), Some(vec![1.0f32, 2.0]));
        assert_eq!(again.find::<Vec<f32>>("sample", 1, 3), None);
        assert_eq!(again.find::<f32>("sample", 0, 3), None, "bytes are left over");
    }

    #[test]
    fn it_is_written_when_it_is_time_and_says_what_is_in_the_way() {
        let written = Arc::new(Mutex::new(0));
        let count = Arc::clone(&written);
        let write = move |blocks: &Blocks| {
            assert!(!blocks.is_empty());
            *count.lock().unwrap() += 1;
            Err("no".to_owned())
        };
        let journal = Journal::new(Blocks::default(), Duration::ZERO, Box::new(write.clone()));
        assert_eq!(journal.keep(("a", 0, 0), &1u32), Err("no".to_owned()));
        let rarely = Journal::new(Blocks::default(), Duration::MAX, Box::new(write));
        assert_eq!(rarely.keep(("a", 0, 0), &1u32), Ok(()));
        assert_eq!(*written.lock().unwrap(), 1);
    }
}
