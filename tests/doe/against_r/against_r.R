# What R says of the data sets in this folder, for tests/doe/against_r/compare.py; `make against-r` runs both.
#
#   Rscript against_r.R FOLDER        (R with its own packages: base, datasets, MASS, nlme)
#
# Writes the data sets that R ships into FOLDER, and reference.csv: data set, R call, quantity, R's number. A response
# surface of the package rsm is an lm of coded factors, and is fitted as one; factors go by letters in the order of the file.
suppressMessages({library(MASS); library(nlme)})
options(digits = 15, contrasts = c("contr.sum", "contr.poly"))
folder <- commandArgs(TRUE)[1]

ship <- function(name, comments, data) {
  stream <- file(file.path(folder, paste0(name, ".csv")), "w")
  writeLines(comments, stream)
  write.csv(data, stream, row.names = FALSE, quote = FALSE)
  close(stream)
}
ship("warpbreaks", c("# R, package datasets: warpbreaks (Tukey 1977, Exploratory Data Analysis, p. 82)",
                     "# levels | wool | A | B", "# levels | tension | L | M | H"),
     warpbreaks[, c("wool", "tension", "breaks")])
ship("anorexia", c("# R, package MASS: anorexia (Hand et al. 1993, A Handbook of Small Data Sets, set 285)",
                   "# factor | Prewt | 70 | 94 | lb", "# levels | Treat | CBT | Cont | FT"),
     anorexia[, c("Prewt", "Treat", "Postwt")])
ship("petrol", c("# R, package MASS: petrol (Prater 1956, Petroleum Refiner 35:236)", "# factor | SG | 30 | 60 | API",
                 "# factor | VP | 0 | 10 | psi", "# factor | V10 | 150 | 350 | F", "# factor | EP | 200 | 450 | F"), petrol)
ship("oats", c("# R, package MASS: oats (Yates 1935, J. R. Stat. Soc. Suppl. 2:181)",
               "# levels | V | Golden.rain | Marvellous | Victory", "# levels | N | 0.0cwt | 0.2cwt | 0.4cwt | 0.6cwt"),
     data.frame(B = oats$B, plot = interaction(oats$B, oats$V), oats[, c("V", "N", "Y")]))
ship("ergoStool", c("# R, package nlme: ergoStool (Devore 2000, Probability and Statistics; Pinheiro and Bates 2000)",
                    "# levels | Type | T1 | T2 | T3 | T4"), as.data.frame(ergoStool)[, c("Subject", "Type", "effort")])
ship("stackloss", c("# R, package datasets: stackloss (Brownlee 1960)", "# factor | Air_Flow | 50 | 80",
                    "# factor | Water_Temp | 17 | 27", "# factor | Acid_Conc | 72 | 93"),
     setNames(stackloss, c("Air_Flow", "Water_Temp", "Acid_Conc", "loss")))
ship("trees", c("# R, package datasets: trees (Ryan, Joiner and Ryan 1976)", "# factor | Girth | 8 | 21 | in",
                "# factor | Height | 63 | 87 | ft"), trees)

reference <- data.frame()
add <- function(name, call, quantities) {
  reference <<- rbind(reference, data.frame(data = name, call = call, quantity = names(quantities),
                                            value = sprintf("%.15g", as.numeric(quantities))))
}

# Factors by letters, numbers coded -1 ... +1; y: the response; every other column by its own name.
data_of <- function(name, response = "y") {
  path <- file.path(folder, paste0(name, ".csv"))
  comments <- grep("^# (factor|levels) ", readLines(path), value = TRUE)
  parts <- strsplit(sub("^# ", "", comments), " *\\| *")
  data <- read.csv(path, comment.char = "#", check.names = FALSE, stringsAsFactors = TRUE)
  found <- list(y = data[[response]])
  for (k in seq_along(parts)) {
    one <- parts[[k]]
    values <- data[[one[2]]]
    if (one[1] == "levels") values <- factor(values, levels = one[-(1:2)])
    else values <- (2 * values - as.numeric(one[3]) - as.numeric(one[4])) / (as.numeric(one[4]) - as.numeric(one[3]))
    found[[LETTERS[k]]] <- values
  }
  others <- setdiff(names(data), c(response, sapply(parts, `[`, 2)))
  as.data.frame(c(found, setNames(data[others], paste0("in_", others, recycle0 = TRUE))))
}
term <- function(names) gsub(":", "*", sub("^I\\(([A-Z])\\^2\\)$", "\\1^2", names), fixed = TRUE)

# Coefficients with errors and p, R-squared, PRESS, single runs, lack of fit.
of_fit <- function(m) {
  s <- summary(m)
  table <- s$coefficients[grep("^[A-Z](:|\\^|$)|^I\\(", rownames(s$coefficients)), , drop = FALSE]
  found <- c(setNames(table[, 1], paste("coefficient", term(rownames(table)))),
             setNames(table[, 2], paste("standard error", term(rownames(table)))),
             setNames(table[, 4], paste("p", term(rownames(table)))))
  press <- sum((resid(m) / (1 - hatvalues(m)))^2)
  total <- sum((m$model$y - mean(m$model$y))^2)
  c(found, "sigma" = s$sigma, "R2" = s$r.squared, "R2 adjusted" = s$adj.r.squared, "PRESS" = press,
    "R2 predicted" = 1 - press / total, "largest studentised residual" = max(abs(rstudent(m))),
    "largest Cook distance" = max(cooks.distance(m)), "Shapiro p" = shapiro.test(rstandard(m))$p.value)
}
lack_of_fit <- function(m) {
  point <- interaction(m$model[, LETTERS[LETTERS %in% names(m$model)]], drop = TRUE)
  pure <- lm(m$model$y ~ point)
  df <- c(df.residual(m) - df.residual(pure), df.residual(pure))
  f <- (deviance(m) - deviance(pure)) / df[1] / (deviance(pure) / df[2])
  c("F lack_of_fit" = f, "p lack_of_fit" = pf(f, df[1], df[2], lower.tail = FALSE))
}
canonical <- function(m, k) {
  b <- coef(m)
  letters <- LETTERS[1:k]
  B <- matrix(0, k, k)
  for (i in 1:k) for (j in 1:k)
    B[i, j] <- if (i == j) b[[sprintf("I(%s^2)", letters[i])]] else b[[paste(sort(letters[c(i, j)]), collapse = ":")]] / 2
  e <- eigen(B)$values
  c(setNames(-solve(B, b[letters]) / 2, paste("stationary", letters)), setNames(e, paste("eigenvalue", 1:k)))
}
box_cox <- function(m) {
  likelihood <- function(power) boxcox(m, lambda = power, plotit = FALSE)$y
  c("Box-Cox power" = optimize(likelihood, c(-3, 3), maximum = TRUE, tol = 1e-9)$maximum)
}
second_order <- function(k) {
  letters <- LETTERS[1:k]
  as.formula(paste("y ~ (", paste(letters, collapse = "+"), ")^2 +", paste(sprintf("I(%s^2)", letters), collapse = "+")))
}
surface <- function(name, k) {
  m <- do.call(lm, list(second_order(k), data_of(name)))  # boxcox evaluates the call again
  add(name, "lm, full second order (rsm: SO); MASS::boxcox", c(of_fit(m), box_cox(m)))
  add(name, "lm beside lm(y ~ point) (rsm: lack of fit)", lack_of_fit(m))
  add(name, "solve(), eigen() (rsm: canonical)", canonical(m, k))
}
joint <- function(m, name, call) {
  table <- drop1(m, . ~ ., test = "F")[-1, ]
  names <- term(rownames(table))
  add(name, call, c(setNames(table$`Sum of Sq`, paste("SS", names)), setNames(table$`F value`, paste("F", names)),
                    setNames(table$`Pr(>F)`, paste("p", names)), "sigma" = summary(m)$sigma))
}

for (name in c("codata", "stress", "uniformity")) surface(name, 2)
surface("resin", 3)
surface("heli", 4)
chem <- data_of("ChemReact")
m <- lm(update(second_order(2), . ~ in_block + .), chem)
add("ChemReact", "lm with block (as rsm's Block + SO)", c(of_fit(m), canonical(m, 2)))
trees_fit <- lm(y ~ (A + B)^2 + I(A^2) + I(B^2), data_of("trees", "Volume"))
add("trees", "lm, full second order; MASS::boxcox", c(of_fit(trees_fit), box_cox(trees_fit)))
loss <- lm(y ~ A + B + C, data_of("stackloss", "loss"))
add("stackloss", "lm, linear; MASS::boxcox", c(of_fit(loss), box_cox(loss)))
add("reactor", "lm, interactions of two", of_fit(lm(y ~ (A + B + C + D + E)^2, data_of("reactor"))))
add("castfatigue", "lm(y ~ F * G)", of_fit(lm(y ~ F * G, data_of("castfatigue"))))
whole <- coef(lm(y ~ A * B * C * D, data_of("filtration")))[-1]
add("filtration", "2 coef(lm(y ~ A*B*C*D))", setNames(2 * whole, paste("effect", term(names(whole)))))
joint(lm(y ~ A * B, data_of("warpbreaks", "breaks")), "warpbreaks", "drop1(lm, contr.sum)")
joint(lm(y ~ A * B, data_of("anorexia", "Postwt")), "anorexia", "drop1(lm, contr.sum)")


strata <- summary(suppressWarnings(aov(y ~ in_B + B * A + Error(in_plot), data_of("oats", "Y"))))
plots <- strata[[1]][[1]]
within <- strata[[2]][[1]]
row_of <- function(table, name) which(trimws(rownames(table)) == name)
mean_squares <- c(plots[row_of(plots, "Residuals"), "Mean Sq"], within[row_of(within, "Residuals"), "Mean Sq"])
add("oats", "aov(Y ~ B + N*V + Error(plot))", c(
  "F A" = plots[row_of(plots, "A"), "F value"], "p A" = plots[row_of(plots, "A"), "Pr(>F)"],
  "F B" = within[row_of(within, "B"), "F value"], "F A*B" = within[row_of(within, "B:A"), "F value"],
  "p A*B" = within[row_of(within, "B:A"), "Pr(>F)"], "error df A" = plots[row_of(plots, "Residuals"), "Df"],
  "error df B" = within[row_of(within, "Residuals"), "Df"],
  "variance between" = (mean_squares[1] - mean_squares[2]) / 4, "variance within" = mean_squares[2]))
mixed <- function(name, response, fixed, random, call) {
  m <- lme(fixed, data_of(name, response), random = random)
  variances <- as.numeric(VarCorr(m)[, "Variance"])
  found <- c("variance between" = variances[1], "variance within" = variances[2])
  table <- summary(m)$tTable
  numbers <- grepl("^[A-Z]$", rownames(table))
  if (any(numbers)) {
    found <- c(found, "deviance" = -2 * as.numeric(logLik(m)))
    found <- c(found, setNames(table[numbers, "Value"], paste("coefficient", rownames(table)[numbers])))
    found <- c(found, setNames(table[numbers, "Std.Error"], paste("standard error", rownames(table)[numbers])))
  } else {
    test <- anova(m, type = "marginal")
    found <- c(found, "F A" = test["A", "F-value"], "p A" = test["A", "p-value"], "error df A" = test["A", "denDF"])
  }
  add(name, call, found)
}
mixed("ergoStool", "effort", y ~ A, ~ 1 | in_Subject, "nlme::lme, random = ~1 | Subject")
mixed("petrol", "Y", y ~ A + B + C + D, ~ 1 | in_No, "nlme::lme, random = ~1 | No")

stream <- file(file.path(folder, "reference.csv"), "w")
writeLines(paste("# Made by against_r.R with", R.version.string), stream)
write.csv(reference, stream, row.names = FALSE)
close(stream)
