//! Fewer points that still show the same curve.

/// Keeps at most about `limit` of the items that come in, evenly, and always the first and the last.
pub(super) struct Thinned<T> {
    limit: usize,
    stride: u64,
    count: u64,
    kept: Vec<T>,
    /// The latest item, where the stride skips it.
    last: Option<T>,
}

impl<T> Thinned<T> {
    /// Memory is bounded by `limit` items, of which half are left whenever it is reached.
    pub(super) fn new(limit: usize) -> Self {
        Self {
            // Even, so that halving keeps the item just pushed.
            limit: limit.next_multiple_of(2),
            stride: 1,
            count: 0,
            kept: Vec::new(),
            last: None,
        }
    }

    pub(super) fn push(&mut self, item: T) {
        if self.count.is_multiple_of(self.stride) {
            self.kept.push(item);
            self.last = None;
            if self.kept.len() > self.limit {
                let mut index = 0;
                self.kept.retain(|_| {
                    index += 1;
                    index % 2 == 1
                });
                self.stride *= 2;
            }
        } else {
            self.last = Some(item);
        }
        self.count += 1;
    }

    pub(super) fn finish(mut self) -> Vec<T> {
        self.kept.extend(self.last);
        self.kept
    }
}

/// At most `limit` (≥ 2) indices below `length`, evenly spaced, the first and the last among them.
pub(crate) fn even(length: usize, limit: usize) -> Vec<usize> {
    if length <= limit {
        return (0..length).collect();
    }
    (0..limit).map(|i| i * (length - 1) / (limit - 1)).collect()
}

/// A curve of at most `2 buckets + 2` points with the same ends and, in every bucket, the same extremes.
pub(super) fn envelope(points: Vec<[f64; 2]>, buckets: usize) -> Vec<[f64; 2]> {
    let [first, inner @ .., last] = points.as_slice() else {
        return points;
    };
    if inner.len() <= 2 * buckets {
        return points;
    }
    let mut kept = vec![*first];
    for bucket in inner.chunks(inner.len().div_ceil(buckets)) {
        let by_value = |a: &(usize, &[f64; 2]), b: &(usize, &[f64; 2])| a.1[1].total_cmp(&b.1[1]);
        let extremes = [
            bucket.iter().enumerate().min_by(by_value),
            bucket.iter().enumerate().max_by(by_value),
        ];
        let mut extremes: Vec<_> = extremes.into_iter().flatten().collect();
        extremes.sort_by_key(|(index, _)| *index);
        extremes.dedup_by_key(|(index, _)| *index);
        kept.extend(extremes.into_iter().map(|(_, point)| *point));
    }
    kept.push(*last);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_ends_order_and_an_even_spacing() {
        for count in [1, 2, 9, 10, 11, 12, 100, 1001, 4096] {
            let mut thinned = Thinned::new(10);
            (0..count).for_each(|item| thinned.push(item));
            let kept = thinned.finish();
            assert_eq!(kept.first(), Some(&0));
            assert_eq!(kept.last(), Some(&(count - 1)));
            assert!(kept.len() <= 11 && kept.len() >= count.min(5), "{kept:?}");
            let gaps: Vec<_> = kept.windows(2).map(|pair| pair[1] - pair[0]).collect();
            if let [regular @ .., rest] = gaps.as_slice() {
                assert!(regular.iter().all(|gap| *gap == gaps[0]), "{kept:?}");
                assert!((1..=gaps[0]).contains(rest), "{kept:?}");
            }
        }
        assert!(Thinned::<u8>::new(10).finish().is_empty());
    }

    #[test]
    fn even_indices_span_the_whole() {
        assert_eq!(even(0, 3), Vec::<usize>::new());
        assert_eq!(even(3, 5), [0, 1, 2]);
        assert_eq!(even(1001, 5), [0, 250, 500, 750, 1000]);
        assert_eq!(even(10, 4), [0, 3, 6, 9]);
    }

    #[test]
    fn an_envelope_keeps_ends_and_single_spikes() {
        let mut points: Vec<_> = (0..10_000).map(|k| [f64::from(k), 0.0]).collect();
        points[0][1] = 0.5;
        points[4321][1] = 7.0;
        points[4322][1] = -3.0;
        points[9999][1] = 0.25;
        let kept = envelope(points.clone(), 50);
        assert!(kept.len() <= 102, "{}", kept.len());
        for index in [0, 4321, 4322, 9999] {
            assert!(kept.contains(&points[index]), "{:?} is lost", points[index]);
        }
        assert_eq!((kept[0], kept[kept.len() - 1]), (points[0], points[9999]));
        assert!(
            kept.windows(2).all(|pair| pair[0][0] < pair[1][0]),
            "out of order"
        );
    }
}
