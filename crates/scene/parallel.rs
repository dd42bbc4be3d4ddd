//! Work on each of many items on all cores, where the order does not matter: results are the same to the bit, whatever the number
//! of threads.

use rayon::prelude::*;

/// Fewer items than these a thread alone has done before others have woken up.
const ENOUGH: usize = 1 << 14;

/// Each of the items by `map`, in their order.
pub(crate) fn mapped<T: Sync, U: Send>(items: &[T], map: impl Fn(&T) -> U + Send + Sync) -> Vec<U> {
    if items.len() < ENOUGH {
        items.iter().map(map).collect()
    } else {
        items.par_iter().map(map).collect()
    }
}

/// Does `found` hold for any of the items? Not all of them may be asked.
pub(crate) fn any<T: Sync>(items: &[T], found: impl Fn(&T) -> bool + Send + Sync) -> bool {
    if items.len() < ENOUGH {
        items.iter().any(found)
    } else {
        items.par_iter().any(found)
    }
}

/// As [`any`], of items each of which may take long.
pub(crate) fn any_of_large<T: Sync>(items: &[T], found: impl Fn(&T) -> bool + Send + Sync) -> bool {
    items.par_iter().any(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_is_kept() {
        for count in [0, 3, ENOUGH, 3 * ENOUGH + 1] {
            let items: Vec<usize> = (0..count).collect();
            assert_eq!(mapped(&items, |item| *item), items);
            let has = |wanted| any(&items, |item| *item == wanted);
            assert_eq!([has(count / 2), has(count)], [count > 0, false]);
            let has = |wanted| any_of_large(&items, |item| *item == wanted);
            assert_eq!([has(count / 2), has(count)], [count > 0, false]);
        }
    }
}
