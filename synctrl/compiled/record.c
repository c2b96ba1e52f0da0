/* What is kept of an instant at which the loop was evaluated: rows of the log, and the measures of runs. */

/* What follows from the state, and nothing but the log asks for. */
static void know(const Cell *c, Quantities *a) {
    for (int i = 0; i < c->n; i++)
        if (kinds[c->kind[i]].estimate) call_estimate(c, a, i);
        else memcpy(a->theta_hat + (size_t)i * P, a->z + (size_t)i * Z, sizeof(vec) * P);
    if (c->exchange.hearing != IDEAL) compare(c, a->memory, a->integral); /* S W */
}

/* The rows of some lanes, one after another. */
INSIDE void turn_over(const vec *rows, int lanes, int length, double *numbers) {
    const double *from = (const double *)rows;
    for (int l = 0; l < lanes; l++, from++, numbers += length) {
        int j = 0;
        for (; j + LANES <= length; j += LANES) store(numbers + j, strided(from + j * LANES));
        for (; j < length; j++) numbers[j] = from[j * LANES];
    }
}

/* Rows of robots or pairs out of their lanes, one after another. */
INSIDE void take_out(const Cell *c, const vec *rows, int count, int length, double *numbers) {
    if (!c->scattered) { for (int j = 0; j < count * length; j++) numbers[j] = lane(rows[j], 0); return; }
    for (; count >= LANES; count -= LANES, rows += length, numbers += LANES * length)
        turn_over(rows, LANES, length, numbers);
    turn_over(rows, count, length, numbers);
}

/* One row of the log: of robots and pairs that of each, of what network and plant remember that of the first lane. */
static void record(const Cell *c, Quantities *a, long row, const Log *log) {
#define NUMBERS_n(name, to, columns) take_out(c, a->name, c->robots, columns, to + row * c->robots * (columns));
#define NUMBERS_p(name, to, columns) take_out(c, a->name, c->pairs, columns, to + row * c->pairs * (columns));
#define NUMBERS_r(name, to, columns) for (int j = 0; j < c->r; j++) to[row * c->r + j] = lane(a->name[j], 0);
#define NUMBERS_h(name, to, columns) for (int j = 0; j < c->h; j++) to[row * c->h + j] = lane(a->name[j], 0);
#define COPY(log_name, name, rows, columns) \
    if (log->log_name) { NUMBERS_##rows(name, log->log_name, columns) }
    LOGS(COPY)
}

/* What is measured of errors: largest, integral of the square by the trapezoidal rule, last instant outside a band. */
static void measure_errors(const vec *e, int rows, double span, long row, Errors *x) {
    for (int i = 0, j = 0; i < rows; i++)
        for (int k = 0; k < m; k++, j++) {
            vec size = v_fabs(e[j]), square = e[j] * e[j];
            x->peak[j] = choose(is_less(x->peak[j], size), size, x->peak[j]);
            x->ise[j] += splat(span) * (square + x->square[j]) / splat(2);
            x->outside[j] = choose(is_less(x->band[k], size), splat(row), x->outside[j]);
            x->square[j] = square;
            x->final[j] = e[j];
        }
}

/* Numbers of a user's own at one instant. */
typedef void Own(const Quantities *a, vec *numbers);

/* What is made of them: the largest, and the integral by the trapezoidal rule. */
static void measure_own(const Quantities *a, double span, Tally *x) {
    ((Own *)x->own)(a, x->now);
    for (long k = 0; k < x->count; k++) {
        x->largest[k] = choose(is_less(x->largest[k], x->now[k]), x->now[k], x->largest[k]);
        x->integral[k] += splat(span) * (x->now[k] + x->before[k]) / splat(2);
        x->before[k] = x->now[k];
    }
}

/* Measures of all runs at one instant. */
static void tally(const Cell *c, const Quantities *a, double t, Tally *x) {
    double span = x->rows ? t - x->t : 0;
    measure_errors(a->e, c->n, span, x->rows, &x->tracking);
    measure_errors(a->epsilon, c->p, span, x->rows, &x->sync);
    for (int j = 0; j < c->n * nv; j++) {
        vec size = v_fabs(a->acting[j]), cut = where(is_less(a->limits[j], size), splat(1));
        x->torque[j] = choose(is_less(x->torque[j], size), size, x->torque[j]);
        x->cut[j] += cut;
    }
    if (x->own) measure_own(a, span, x);
    x->t = t;
    x->rows++;
}
