//! Tests of hypotheses.
