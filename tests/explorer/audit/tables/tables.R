# Analyses of variance of published data sets, for tests/explorer/audit/test_anova_tables.py.
#
#   Rscript tables.R PUBLISHED_FOLDER OUT_FOLDER        (base R alone; README.md here says which table is whose)
#
# r_* are R's own print, taken over character by character. The others have rows, columns and rounding as the program of
# their name prints them, and figures that R computed.
arguments <- commandArgs(TRUE)
source_folder <- arguments[1]
out_folder <- arguments[2]

data_of <- function(name) {
  lines <- readLines(file.path(source_folder, paste0(name, ".csv")))
  ranges <- strsplit(sub("^# factor \\| ", "", lines[startsWith(lines, "# factor")]), " *\\| *")
  text <- read.csv(file.path(source_folder, paste0(name, ".csv")), comment.char = "#", colClasses = "character")
  list(name = name, text = text, natural = as.data.frame(lapply(text, as.numeric)),
       factors = sapply(ranges, `[`, 1), low = as.numeric(sapply(ranges, `[`, 2)),
       high = as.numeric(sapply(ranges, `[`, 3)))
}

coded <- function(data) {
  found <- data$natural
  for (k in seq_along(data$factors)) {
    column <- data$factors[k]
    found[[column]] <- (2 * found[[column]] - data$low[k] - data$high[k]) / (data$high[k] - data$low[k])
  }
  found
}

write_case <- function(case, data, rows, source, separator = ",") {
  folder <- file.path(out_folder, case)
  dir.create(folder, showWarnings = FALSE, recursive = TRUE)
  write.table(data$text, file.path(folder, "runs.csv"), sep = ",", quote = FALSE, row.names = FALSE)
  writeLines(sapply(rows, paste, collapse = separator), file.path(folder, "anova.csv"))
  factors <- sprintf('[[surface.factor]]\nname = "%s"\ncolumn = "%s"\nlow = %s\nhigh = %s', data$factors, data$factors,
                     format(data$low), format(data$high))
  writeLines(c("format = 1", sprintf('title = "%s"', data$name), sprintf('source = "%s"', source), "", "[surface]",
               'runs = "runs.csv"', 'where_runs = "the runs"', "coded = false", 'response = "y"',
               'anova = "anova.csv"', 'where_anova = "the table"', factors), file.path(folder, "study.toml"))
}

p_text <- function(p, least, form) ifelse(p < 0.5 * 10^-nchar(sub(".*\\.", "", least)), paste0("<", least), sprintf(form, p))

# Residual sum of squares and degrees of freedom of a model; pure error of the replicates.
rss <- function(formula, data) { m <- lm(formula, data); c(ss = deviance(m), df = df.residual(m)) }
pure <- function(data, factors) {
  group <- interaction(data[factors], drop = TRUE)
  c(ss = sum((data$y - ave(data$y, group))^2), df = nrow(data) - nlevels(group))
}

# What each term adds to the rest of the model: drop it from the model matrix.
partial <- function(model) {
  x <- model.matrix(model)
  y <- model$model[[1]]
  sapply(colnames(x)[-1], function(term) sum(lm.fit(x[, colnames(x) != term, drop = FALSE], y)$residuals^2)) - deviance(model)
}

second_order <- function(factors) {
  squares <- sprintf("I(%s^2)", factors)
  products <- if (length(factors) > 1) combn(factors, 2, paste, collapse = ":") else character()
  list(linear = factors, products = products, squares = squares)
}
as_model <- function(terms) reformulate(terms, "y")

printed_by_r <- function(model) {
  lines <- capture.output(print(anova(model)))
  lines <- lines[grepl("^(I\\(|[A-Za-z])", lines) & !grepl("^(Analysis|Response|Signif)", lines)]
  body <- lapply(strsplit(gsub("< ", "<", lines), " +"), function(one) {
    one <- one[one != ""]
    one <- one[!grepl("^(\\.|\\*+)$", one)]
    c(one, rep("", 6 - length(one)))
  })
  c(list(c("source", "Df", "Sum Sq", "Mean Sq", "F value", "Pr(>F)")), body)
}

# 1. R, anova(lm): sequential sums of squares of a design without any orthogonality.
d <- data_of("random_unbalanced")
t <- second_order(d$factors)
write_case("r_anova_unbalanced", d, printed_by_r(lm(as_model(unlist(t)), coded(d))), "R 4.2.2, anova(lm(...)), its own print")

# 2. R, anova(lm): a model without its main effect.
d <- data_of("castfatigue_PB12")
write_case("r_anova_reduced", d, printed_by_r(lm(y ~ F + F:G, coded(d))), "R 4.2.2, anova(lm(...)), its own print")

# 3. SAS GLM, Type III, in natural units: linear terms are tested where all factors are zero.
d <- data_of("chem7.6_noblock")
x <- d$natural
model <- lm(y ~ Time + Temp + I(Time^2) + I(Temp^2) + Time:Temp, x)
ss <- partial(model)
mse <- deviance(model) / df.residual(model)
total <- sum((x$y - mean(x$y))^2)
sas <- function(name, df, ss, error = mse, dfe = df.residual(model), tested = TRUE) c(
  name, df, sprintf("%.8f", ss), sprintf("%.8f", ss / df), if (tested) sprintf("%.2f", ss / df / error) else "",
  if (tested) p_text(pf(ss / df / error, df, dfe, lower.tail = FALSE), ".0001", "%.4f") else "")
rows <- list(c("Source", "DF", "Type III SS", "Mean Square", "F Value", "Pr > F"),
             sas("Model", 5, total - deviance(model)), sas("Error", 8, deviance(model), tested = FALSE),
             c("Corrected Total", 13, sprintf("%.8f", total), "", "", ""))
for (k in seq_along(ss)) rows <- c(rows, list(sas(c("Time", "Temp", "Time*Time", "Temp*Temp", "Time*Temp")[k], 1, ss[k])))
write_case("sas_glm_natural", d, rows, "figures by R 4.2.2, layout of SAS PROC GLM")

# 4. SAS RSREG: groups alone, sequential.
d <- data_of("NIST_uniformity")
x <- coded(d)
t <- second_order(d$factors)
steps <- rbind(rss(y ~ 1, x), rss(as_model(t$linear), x), rss(as_model(c(t$linear, t$squares)), x),
               rss(as_model(unlist(t)), x))
error <- steps[4, ]
replicates <- pure(x, d$factors)
lack <- error - replicates
rsreg <- function(name, df, ss, ms = NULL, dfe = NULL) c(
  name, df, sprintf("%.6f", ss), sprintf("%.6f", ss / df), if (is.null(ms)) "" else sprintf("%.2f", ss / df / ms),
  if (is.null(ms)) "" else p_text(pf(ss / df / ms, df, dfe, lower.tail = FALSE), ".0001", "%.4f"))
mse <- error["ss"] / error["df"]
groups <- mapply(function(name, k) list(rsreg(name, steps[k, "df"] - steps[k + 1, "df"], steps[k, "ss"] - steps[k + 1, "ss"],
                                              mse, error["df"])), c("Linear", "Quadratic", "Crossproduct"), 1:3)
write_case("sas_rsreg", d, c(list(c("Regression", "DF", "Type I Sum of Squares", "Mean Square", "F Value", "Pr > F")), groups, list(
  rsreg("Total Model", 5, steps[1, "ss"] - error["ss"], mse, error["df"]),
  rsreg("Lack of Fit", lack["df"], lack["ss"], replicates["ss"] / replicates["df"], replicates["df"]),
  rsreg("Pure Error", replicates["df"], replicates["ss"]), rsreg("Total Error", error["df"], error["ss"]))),
  "figures by R 4.2.2, layout of SAS PROC RSREG")

# 5. Minitab: groups with their members, sequential and adjusted sums of squares.
d <- data_of("heli_noblock")
x <- coded(d)
t <- second_order(d$factors)
order <- c(t$linear, t$squares, t$products)
model <- lm(as_model(order), x)
adjusted <- partial(model)
names(adjusted) <- gsub(":", "*", gsub("I\\((.*)\\^2\\)", "\\1*\\1", names(adjusted)))
sequential <- anova(model)[seq_along(order), "Sum Sq"]
names(sequential) <- gsub(":", "*", gsub("I\\((.*)\\^2\\)", "\\1*\\1", order))
full <- rss(as_model(order), x)
replicates <- pure(x, d$factors)
lack <- full - replicates
total <- rss(y ~ 1, x)
mse <- full["ss"] / full["df"]
minitab <- function(name, df, seq, adj, ms = NULL, dfe = NULL) c(
  name, df, sprintf("%.2f", seq), sprintf("%.2f", adj), sprintf("%.3f", adj / df),
  if (is.null(ms)) "" else sprintf("%.2f", adj / df / ms),
  if (is.null(ms)) "" else sprintf("%.3f", pf(adj / df / ms, df, dfe, lower.tail = FALSE)))
rows <- list(c("Source", "DF", "Seq SS", "Adj SS", "Adj MS", "F-Value", "P-Value"),
             minitab("Model", 14, total["ss"] - full["ss"], total["ss"] - full["ss"], mse, full["df"]))
before <- character()
for (group in list(list("  Linear", t$linear), list("  Square", t$squares), list("  2-Way Interaction", t$products))) {
  members <- gsub(":", "*", gsub("I\\((.*)\\^2\\)", "\\1*\\1", group[[2]]))
  extra <- rss(as_model(setdiff(order, group[[2]])), x)["ss"] - full["ss"]
  first <- if (length(before)) rss(as_model(before), x) else total
  before <- c(before, group[[2]])
  rows <- c(rows, list(minitab(group[[1]], length(members), first["ss"] - rss(as_model(before), x)["ss"], extra, mse, full["df"])))
  for (one in members) rows <- c(rows, list(minitab(paste0("    ", one), 1, sequential[one], adjusted[one], mse, full["df"])))
}
rows <- c(rows, list(minitab("Error", full["df"], full["ss"], full["ss"]),
                     minitab("  Lack-of-Fit", lack["df"], lack["ss"], lack["ss"], replicates["ss"] / replicates["df"], replicates["df"]),
                     minitab("  Pure Error", replicates["df"], replicates["ss"], replicates["ss"]),
                     c("Total", total["df"], sprintf("%.2f", total["ss"]), "", "", "*", "*")))
write_case("minitab", d, rows, "figures by R 4.2.2, layout of Minitab")

# 6. Design-Expert: a reduced model, letters with names.
d <- data_of("BB_myers7.5")
x <- coded(d)
model <- lm(y ~ temp + rate + temp:rate + I(temp^2), x)
full <- rss(formula(model), x)
ss <- partial(model)
replicates <- pure(x, d$factors)
lack <- full - replicates
total <- rss(y ~ 1, x)
mse <- full["ss"] / full["df"]
expert <- function(name, df, ss, ms = NULL, dfe = NULL) c(
  name, sprintf("%.2f", ss), df, sprintf("%.2f", ss / df), if (is.null(ms)) "" else sprintf("%.2f", ss / df / ms),
  if (is.null(ms)) "" else p_text(pf(ss / df / ms, df, dfe, lower.tail = FALSE), "0.0001", "%.4f"))
write_case("design_expert_reduced", d, list(
  c("Source", "Sum of Squares", "df", "Mean Square", "F-value", "p-value"),
  expert("Model", 4, total["ss"] - full["ss"], mse, full["df"]), expert("A-temp", 1, ss["temp"], mse, full["df"]),
  expert("C-rate", 1, ss["rate"], mse, full["df"]), expert("AC", 1, ss["temp:rate"], mse, full["df"]),
  expert("A²", 1, ss["I(temp^2)"], mse, full["df"]), expert("Residual", full["df"], full["ss"]),
  expert("Lack of Fit", lack["df"], lack["ss"], replicates["ss"] / replicates["df"], replicates["df"]),
  expert("Pure Error", replicates["df"], replicates["ss"]),
  c("Cor Total", sprintf("%.2f", total["ss"]), total["df"], "", "", "")), "figures by R 4.2.2, layout of Design-Expert")

# 7. JMP: three tables below one another, stars at small p.
d <- data_of("codata")
x <- coded(d)
model <- lm(y ~ x1 + x2 + x1:x2 + I(x1^2) + I(x2^2), x)
full <- rss(formula(model), x)
ss <- partial(model)
replicates <- pure(x, d$factors)
lack <- full - replicates
total <- rss(y ~ 1, x)
mse <- full["ss"] / full["df"]
stars <- function(p) paste0(p_text(p, ".0001", "%.4f"), ifelse(p < 0.05, "*", ""))
jmp <- function(name, df, ss, ms = NULL, dfe = NULL) c(
  name, df, sprintf("%.5f", ss), sprintf("%.3f", ss / df), if (is.null(ms)) "" else sprintf("%.4f", ss / df / ms),
  if (is.null(ms)) "" else stars(pf(ss / df / ms, df, dfe, lower.tail = FALSE)))
effect <- function(name, ss) replace(jmp(name, 1, ss, mse, full["df"]), 4, "")
write_case("jmp", d, list(
  c("Source", "DF", "Sum of Squares", "Mean Square", "F Ratio", "Prob > F"),
  jmp("Model", 5, total["ss"] - full["ss"], mse, full["df"]), jmp("Error", full["df"], full["ss"]),
  c("C. Total", total["df"], sprintf("%.5f", total["ss"]), "", "", ""),
  jmp("Lack Of Fit", lack["df"], lack["ss"], replicates["ss"] / replicates["df"], replicates["df"]),
  jmp("Pure Error", replicates["df"], replicates["ss"]),
  c("Total Error", full["df"], sprintf("%.5f", full["ss"]), "", "", ""),
  effect("x1", ss["x1"]), effect("x2", ss["x2"]), effect("x1*x2", ss["x1:x2"]), effect("x1*x1", ss["I(x1^2)"]),
  effect("x2*x2", ss["I(x2^2)"])), "figures by R 4.2.2, layout of JMP")

# 8. Statistica: decimal commas, effects tested against the pure error.
d <- data_of("NIST_stress")
x <- coded(d)
model <- lm(y ~ P + I(P^2) + R + I(R^2) + P:R, x)
full <- rss(formula(model), x)
ss <- partial(model)
replicates <- pure(x, d$factors)
lack <- full - replicates
total <- rss(y ~ 1, x)
ms <- replicates["ss"] / replicates["df"]
statistica <- function(name, df, ss, tested = TRUE) gsub(".", ",", c(
  name, sprintf("%.6f", ss), df, sprintf("%.6f", ss / df), if (tested) sprintf("%.4f", ss / df / ms) else "",
  if (tested) sprintf("%.6f", pf(ss / df / ms, df, replicates["df"], lower.tail = FALSE)) else ""), fixed = TRUE)
write_case("statistica_pure_error", d, list(
  c("Factor", "SS", "df", "MS", "F", "p"), statistica("(1)P (L)", 1, ss["P"]), statistica("P (Q)", 1, ss["I(P^2)"]),
  statistica("(2)R (L)", 1, ss["R"]), statistica("R (Q)", 1, ss["I(R^2)"]), statistica("1L by 2L", 1, ss["P:R"]),
  statistica("Lack of Fit", lack["df"], lack["ss"]), statistica("Pure Error", replicates["df"], replicates["ss"], FALSE),
  gsub(".", ",", c("Total SS", sprintf("%.6f", total["ss"]), total["df"], "", "", ""), fixed = TRUE)),
  "figures by R 4.2.2, layout of Statistica", separator = ";")

# 9. rsm::rsm, summary(...)$lof as it stands in the R.txt beside the data; once with the responses printed to 0.1.
printed_by_rsm <- function(name) {
  lines <- readLines(file.path(source_folder, paste0(name, ".R.txt")))
  lines <- lines[grepl("^((FO|TWI|PQ)\\(|Residuals|Lack of fit|Pure error)", lines)]
  body <- lapply(lines, function(line) {
    source <- regmatches(line, regexpr("^([A-Z]+\\([^)]*\\)|Residuals|Lack of fit|Pure error)", line))
    cells <- strsplit(trimws(substring(line, nchar(source) + 1)), " +")[[1]]
    cells <- cells[!grepl("^(\\.|\\*+)$", cells)]
    c(sprintf('"%s"', source), cells, rep("", 5 - length(cells)))
  })
  c(list(c("source", "Df", "Sum Sq", "Mean Sq", "F value", "Pr(>F)")), body)
}
d <- data_of("codata")
write_case("r_rsm", d, printed_by_rsm("codata"), "R 4.2, rsm 2.10.6, its own print")
d <- data_of("random_unbalanced")
d$text$y <- sprintf("%.1f", d$natural$y)
write_case("r_rsm_rounded_runs", d, printed_by_rsm("random_unbalanced"), "R 4.2, rsm 2.10.6, its own print; runs rounded here")
