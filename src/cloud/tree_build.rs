//! The building of the tree of discs: sorted elements are split in two until few are left, and
//! every group's sums are joined from its parts' on the way back.
//!
//! Input are Morton codes in rising order and the discs in the same order; output is a [`Part`]:
//! nodes and appearances in depth-first order, where a node's first child follows it. A group is
//! split where the highest bit that differs within it turns, or in the middle when all its codes
//! are equal, down to leaves of at most eight discs. Large groups are built by two threads; since
//! the splits depend on the codes alone, the result is the same for any number of threads. The
//! cost is O(n) after the sort.

use glam::UVec3;

use super::group_sums::GroupSums;
use super::hierarchy::{Appearance, Disc, Node};

/// Most elements of a leaf.
pub(super) const LEAF: usize = 8;
/// Groups of fewer elements are built by one thread.
const SERIAL: usize = 1 << 14;

/// A piece of the tree in depth-first order; `next` of inner nodes is relative to the piece.
#[derive(Default)]
pub(super) struct Part {
    pub nodes: Vec<Node>,
    pub appearances: Vec<Appearance>,
}

/// Builds the group of elements `from .. from + codes.len()`; second its sums.
pub(super) fn build(codes: &[(u64, u32)], discs: &[Disc], from: usize) -> (Part, GroupSums) {
    let mut part = Part::default();
    let sums = if codes.len() > SERIAL {
        let middle = split(codes);
        let ((left, a), (right, b)) = rayon::join(
            || build(&codes[..middle], &discs[..middle], from),
            || build(&codes[middle..], &discs[middle..], from + middle),
        );
        let sums = a.join(&b);
        let first = 1 + left.nodes.len() as u32;
        part.nodes.reserve(1 + left.nodes.len() + right.nodes.len());
        part.appearances.reserve(1 + left.nodes.len() + right.nodes.len());
        part.nodes.push(sums.node(first, 0));
        part.appearances.push(sums.appearance());
        for (child, base) in [(left, 1), (right, first)] {
            part.nodes.extend(
                child
                    .nodes
                    .into_iter()
                    .map(|n| if n.count == 0 { Node { next: n.next + base, ..n } } else { n }),
            );
            part.appearances.extend(child.appearances);
        }
        sums
    } else {
        serial(codes, discs, from, &mut part)
    };
    (part, sums)
}

fn serial(codes: &[(u64, u32)], discs: &[Disc], from: usize, part: &mut Part) -> GroupSums {
    if codes.len() <= LEAF {
        let mut sums = GroupSums::of_element(&discs[0]);
        for disc in &discs[1..] {
            sums = sums.join(&GroupSums::of_element(disc));
        }
        part.nodes.push(sums.node(from as u32, codes.len() as u8));
        part.appearances.push(sums.appearance());
        return sums;
    }
    let at = part.nodes.len();
    let empty = GroupSums::of_element(&discs[0]);
    part.nodes.push(empty.node(0, 0));
    part.appearances.push(empty.appearance());
    let middle = split(codes);
    let a = serial(&codes[..middle], &discs[..middle], from, part);
    let second = part.nodes.len() as u32;
    let b = serial(&codes[middle..], &discs[middle..], from + middle, part);
    let sums = a.join(&b);
    part.nodes[at] = sums.node(second, 0);
    part.appearances[at] = sums.appearance();
    sums
}

/// Where the highest differing bit turns; the middle when all codes are equal.
fn split(codes: &[(u64, u32)]) -> usize {
    let (first, last) = (codes[0].0, codes[codes.len() - 1].0);
    if first == last {
        return codes.len() / 2;
    }
    let bit = 1u64 << (63 - (first ^ last).leading_zeros());
    codes.partition_point(|c| c.0 & bit == 0)
}

/// Every third bit, 21 of them.
fn spread(x: u32) -> u64 {
    let mut x = u64::from(x) & 0x1f_ffff;
    for (shift, mask) in [
        (32, 0x1f_0000_0000_ffff),
        (16, 0x1f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ] {
        x = (x | x << shift) & mask;
    }
    x
}

/// Place of a grid cell on the Morton curve: the bits of its coordinates interleaved, x highest.
pub(super) fn morton_code(cell: UVec3) -> u64 {
    spread(cell.x) << 2 | spread(cell.y) << 1 | spread(cell.z)
}
