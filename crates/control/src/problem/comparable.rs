use std::any::Any;

/// A value that can be compared with values of any type. Every type that is `PartialEq` implements it.
pub trait Comparable: Any {
    /// Returns true if `other` is of the same type and equal.
    fn equals(&self, other: &dyn Any) -> bool;
}

impl<T: Any + PartialEq> Comparable for T {
    fn equals(&self, other: &dyn Any) -> bool {
        other.downcast_ref() == Some(self)
    }
}
