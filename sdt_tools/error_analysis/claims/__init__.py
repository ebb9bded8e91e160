"""The paper's claims held against predictions: each supported, contradicted or undecided, with its numbers."""
