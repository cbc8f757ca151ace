//! Mitsuba.
