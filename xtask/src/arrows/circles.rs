//! Circles: sets of files each of which imports, by way of others, every other one of the set.

use std::collections::BTreeSet;

/// Every circle among `n` nodes, each in ascending order, by their first nodes.
pub fn circles(n: usize, arrows: &BTreeSet<(usize, usize)>) -> Vec<Vec<usize>> {
    let reached: Vec<BTreeSet<usize>> = (0..n).map(|node| reached_from(node, arrows)).collect();
    let mut circles: Vec<Vec<usize>> = Vec::new();
    for node in 0..n {
        if circles.iter().any(|circle| circle.contains(&node)) {
            continue;
        }
        let back = |other: &usize| reached[*other].contains(&node);
        let circle: Vec<usize> = reached[node].iter().copied().filter(back).collect();
        if circle.len() > 1 {
            circles.push(circle);
        }
    }
    circles
}

/// Nodes to which arrows lead, one after another.
fn reached_from(node: usize, arrows: &BTreeSet<(usize, usize)>) -> BTreeSet<usize> {
    let mut reached = BTreeSet::new();
    let mut open = vec![node];
    while let Some(from) = open.pop() {
        for (_, to) in arrows.range((from, 0)..=(from, usize::MAX)) {
            if reached.insert(*to) {
                open.push(*to);
            }
        }
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_is_found_whole_and_what_hangs_on_it_is_not_in_it() {
        let arrows = BTreeSet::from([
            (0, 1),
            (1, 2),
            (2, 1),
            (2, 3),
            (4, 5),
            (5, 6),
            (6, 4),
            (3, 7),
        ]);
        assert_eq!(circles(8, &arrows), [vec![1, 2], vec![4, 5, 6]]);
        assert_eq!(
            circles(3, &BTreeSet::from([(0, 1), (0, 2), (1, 2)])),
            [[0; 0]; 0]
        );
    }
}
