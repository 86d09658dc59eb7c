//! All integration tests in one binary; modules mirror `src/`.

mod height;
