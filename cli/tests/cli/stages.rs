//! Any stage takes the file of an earlier one.
