/* What is kept of an instant at which the loop was evaluated: rows of the log, and the measures of runs. */

/* What follows from the state, and nothing but the log asks for. */
static void know(const Cell *c, Quantities *a) {
    for (int i = 0; i < c->n; i++)
        if (kinds[c->kind[i]].estimate) call_estimate(c, a, i);
        else memcpy(a->theta_hat + (size_t)i * P, a->z + (size_t)i * Z, sizeof(vec) * P);
    if (c->exchange.hearing != IDEAL) compare(c, a->memory, a->integral); /* S W */
}

/* Rows out of so many lanes, one after another. */
static void take_out(const vec *rows, int lanes, int count, int length, double *numbers) {
    for (int i = 0; i < count; i += lanes, rows += length) {
        const double *from = (const double *)rows;
        for (int l = 0; l < lanes && i + l < count; l++)
            for (int j = 0; j < length; j++) *numbers++ = from[j * LANES + l];
    }
}

/* How many rows there really are, of robots, pairs, and what network and plant remember. */
static int rows_of(const Cell *c, char rows) {
    return rows == 'n' ? c->robots : rows == 'p' ? c->pairs : rows == 'r' ? c->r : c->h;
}

/* In how many lanes they stand; of what is neither a robot's nor a pair's, all lanes have the same. */
static int lanes_of(const Cell *c, char rows) { return c->scattered && (rows == 'n' || rows == 'p') ? LANES : 1; }

/* One row of the log. */
static void record(const Cell *c, Quantities *a, long row, const Log *log) {
#define COPY(log_name, name, rows, columns)                                             \
    if (log->log_name) {                                                                \
        size_t count = rows_of(c, #rows[0]), length = columns;                          \
        take_out(a->name, lanes_of(c, #rows[0]), count, length, log->log_name + row * count * length); \
    }
    LOGS(COPY)
}

/* What is measured of errors: largest, integral of the square by the trapezoidal rule, last instant outside a band. */
static void measure_errors(const vec *e, int rows, double half, long row, Errors *x) {
    for (int i = 0, j = 0; i < rows; i++)
        for (int k = 0; k < m; k++, j++) {
            vec size = v_fabs(e[j]), square = e[j] * e[j];
            x->peak[j] = choose(is_less(x->peak[j], size), size, x->peak[j]);
            x->ise[j] += splat(half) * (square + x->square[j]) / splat(2);
            x->outside[j] = choose(is_less(x->band[k], size), splat(row), x->outside[j]);
            x->square[j] = square;
            x->final[j] = e[j];
        }
}

/* Measures of all runs at one instant, which is row number `row` of a log. */
static void tally(const Cell *c, const Quantities *a, double t, Tally *x) {
    double span = x->rows ? t - x->t : 0;
    measure_errors(a->e, c->n, span, x->rows, &x->tracking);
    measure_errors(a->epsilon, c->p, span, x->rows, &x->sync);
    for (int j = 0; j < c->n * nv; j++) {
        vec size = v_fabs(a->acting[j]), cut = where(is_less(a->limits[j], size), splat(1));
        x->torque[j] = choose(is_less(x->torque[j], size), size, x->torque[j]);
        x->cut[j] += cut;
    }
    x->t = t;
    x->rows++;
}
