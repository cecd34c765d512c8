//! The tree of elements, group by group: for whoever looks at a cloud at one of its levels, or
//! works through its elements in small groups.
//!
//! Input is a [`Hierarchy`]; output are [`Group`]s, or ranges of elements in the tree's order. The
//! groups of one depth, together with the leaves above it, hold every element exactly once.

use glam::Vec3;

use super::Hierarchy;
use super::tree_build::LEAF;

/// A node, for looking at: one disc for all elements below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Group {
    /// First element below, in the tree's order.
    pub first: u32,
    /// Elements below.
    pub count: u32,
    /// Steps from the root.
    pub depth: u32,
    /// Nothing below but elements.
    pub leaf: bool,
    /// Centre of area, world space.
    pub center: Vec3,
    /// Mean normal; its length, at most 1, is the spread.
    pub normal: Vec3,
    /// Sum of areas, scene units squared.
    pub area: f32,
}

impl Hierarchy {
    /// Ranges of elements in the tree's order: the largest groups of at most `most`.
    pub(super) fn groups(&self, most: usize) -> Vec<std::ops::Range<usize>> {
        let span = self.spans();
        let (mut groups, mut stack) = (Vec::new(), vec![0usize]);
        while let Some(i) = stack.pop() {
            let (from, to) = (span[i].0 as usize, span[i].1 as usize);
            if to - from <= most.max(LEAF) {
                groups.push(from..to);
            } else {
                stack.extend([self.nodes[i].next as usize, i + 1]);
            }
        }
        groups
    }
    /// Every node, parents before their children: those of one depth are what the cloud looks like
    /// at that level, beside leaves above it.
    pub fn all_groups(&self) -> Vec<Group> {
        let (span, mut groups) = (self.spans(), Vec::with_capacity(self.nodes.len()));
        let mut open = vec![(0usize, 0u32)];
        while let Some((i, depth)) = open.pop() {
            let (node, (first, end)) = (&self.nodes[i], span[i]);
            let (center, normal, area) =
                (node.center, node.mean_normal(), self.appearances[i].total);
            groups.push(Group {
                first,
                count: end - first,
                depth,
                leaf: node.count > 0,
                center,
                normal,
                area,
            });
            if node.count == 0 {
                open.extend([(node.next as usize, depth + 1), (i + 1, depth + 1)]);
            }
        }
        groups
    }
    /// Range of elements below every node.
    fn spans(&self) -> Vec<(u32, u32)> {
        // From the back: children follow their parent.
        let mut span = vec![(0u32, 0u32); self.nodes.len()];
        for (i, node) in self.nodes.iter().enumerate().rev() {
            span[i] = if node.count > 0 {
                (node.next, node.next + u32::from(node.count))
            } else {
                (span[i + 1].0, span[node.next as usize].1)
            };
        }
        span
    }
}
