"""The paper's experiments done again, with intervals: what is measured stands beside what is printed."""
