"""Hand-made adaptations of the LaTTe subset, right and wrong ones."""

from handmade import LATTE, away, nearer, speed_near, toward

for number, name, share in (
    (0, "labyrinth", 0.06), (19, "bagel", 0.05), (27, "crossword", 0.1), (35, "panda", 0.04), (38, "Siamese cat", 0.1),
    (41, "stoplight", 0.05), (45, "trifle", 0.2), (50, "marmoset", 0.15), (63, "terrace", 0.04),
    (65, "Gordon setter", 0.06), (68, "shako", 0.1),
):  # fmt: skip
    nearer(f"{LATTE}{number}", name, share)
for number, name, share in (
    (9, "cardoon", 0.1), (14, "pretzel", 0.2), (22, "mower", 0.05), (48, "Tringa totanus", 0.1),
    (59, "fiddler crab", 0.1), (74, "curly-coated retriever", 0.15),
):  # fmt: skip
    away(f"{LATTE}{number}", name, share)
for number, name, factor in (
    (1, "orang", 0.7), (6, "shopping basket", 2.0), (10, "damselfly", 0.3), (16, "Irish water spaniel", 1.6),
    (25, "space shuttle", 0.7), (33, "icecream", 0.4), (43, "half track", 1.6), (52, "ladybird beetle", 1.4),
    (56, "prairie wolf", 1.6), (62, "African chameleon", 1.6), (70, "confectionery", 1.4),
):  # fmt: skip
    speed_near(f"{LATTE}{number}", name, factor)
for number, word in (
    (3, "down"), (15, "up"), (23, "left"), (30, "down"), (32, "left"), (36, "down"), (51, "front"), (57, "left"),
    (67, "up"),
):  # fmt: skip
    toward(f"{LATTE}{number}", word)
