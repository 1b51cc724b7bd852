"""The benchmark: cases, and checks that compute whether an adaptation follows its instruction."""
