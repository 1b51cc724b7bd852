# Cumulative-link mixed models of the ratings from 1 to 5, with participants and items as random effects.
#
#     Rscript clmm.R [ratings.csv]     needs the package ordinal; with emmeans, also pairs of conditions
#
# Ratings that the report leaves out (column left_out) are left out here too.
suppressPackageStartupMessages(library(ordinal))

arguments <- commandArgs(trailingOnly = TRUE)
file <- if (length(arguments)) arguments[1] else "ratings.csv"
given <- read.csv(file, stringsAsFactors = FALSE, na.strings = character(0))
given <- given[given$left_out == "", ]
trial <- any(given$pilot == 1)
watermark <- function() if (trial) cat("\n*** PILOT: a trial of the study, not data ***\n")

levels_of <- function(data, name) length(unique(data[[name]]))

for (asked in c("correctness", "interpretability")) {
  data <- given[given$question == asked & given$phase == "rate", ]
  if (nrow(data) == 0) next
  watermark()
  cat("\n== ", asked, ": ", nrow(data), " ratings of ", levels_of(data, "participant"), " people\n", sep = "")
  data$value <- factor(as.numeric(data$value), ordered = TRUE)
  if (nlevels(data$value) < 3) {
    cat("fewer than three different ratings; nothing to fit\n")
    next
  }
  for (name in c("condition", "group", "explanation", "participant", "item")) data[[name]] <- factor(data[[name]])
  fixed <- Filter(function(name) levels_of(data, name) > 1, c("condition", "explanation", "group"))
  random <- Filter(function(name) levels_of(data, name) > 2, c("participant", "item"))
  if (length(fixed) == 0 || length(random) == 0) {
    cat("one condition, or too few people and items; nothing to fit\n")
    next
  }
  terms <- c(fixed, sprintf("(1 | %s)", random))
  model <- clmm(reformulate(terms, response = "value"), data = data)
  print(summary(model))
  for (name in fixed) {
    watermark()
    cat("\nLikelihood ratio test of ", name, "\n", sep = "")
    rest <- setdiff(terms, name)
    print(anova(clmm(reformulate(rest, response = "value"), data = data), model))
  }
  if (requireNamespace("emmeans", quietly = TRUE) && "condition" %in% fixed) {
    watermark()
    cat("\nPairs of conditions on the latent scale, Holm's correction\n")
    print(pairs(emmeans::emmeans(model, ~condition), adjust = "holm"))
  }
}
