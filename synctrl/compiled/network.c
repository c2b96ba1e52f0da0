/* What robots hear of each other: the synchronization errors of pairs, and every robot's shares of them.
 *
 * With the ideal network the memory is the integrals of epsilon. With the others it begins with W, one row per robot,
 * and goes on with parts of which `Exchange` says where they begin; see links.py, receivers.py and delayed.py. What
 * messages say is written into it between two calls. Messages change, and only W and filters flow.
 */

#include <math.h>
#include <stddef.h>

/* S times rows of robots: one row per pair. */
static void compare(const Cell *c, const double *rows, double *epsilon) {
    for (int pair = 0; pair < c->p; pair++, epsilon += m) {
        for (int j = 0; j < m; j++) epsilon[j] = 0;
        for (int t = pair * c->arity; t < (pair + 1) * c->arity; t++) {
            const double *w = rows + (size_t)c->edge[t] * m;
            for (int j = 0; j < m; j++) epsilon[j] += c->sign[t] * w[j];
        }
    }
}

/* E, sigma, sigma' = S^T (integral, epsilon, epsilon') per robot */
static void distribute(const Cell *c, Quantities *a) {
    a->integral = a->memory;
    for (int i = 0; i < c->n; i++) {
        double *E = a->E + (size_t)i * m;
        double *sigma = a->sigma + (size_t)i * m, *sigma_dot = a->sigma_dot + (size_t)i * m;
        for (int j = 0; j < m; j++) E[j] = sigma[j] = sigma_dot[j] = 0;
        for (int t = c->first[i]; t < c->first[i + 1]; t++) {
            size_t pair = (size_t)c->incident[t] * m;
            double sign = c->incident_sign[t];
            for (int j = 0; j < m; j++) {
                E[j] += sign * a->integral[pair + j];
                sigma[j] += sign * a->epsilon[pair + j];
                sigma_dot[j] += sign * a->epsilon_dot[pair + j];
            }
        }
    }
}

/* What is believed of W, w and w' of who is heard on a link, one row after another. */

static void at_once(const Cell *c, const Quantities *a, int link, double *heard) {
    size_t from = (size_t)c->exchange.sender[link] * m;
    for (int j = 0; j < m; j++) {
        heard[j] = a->memory[from + j];
        heard[m + j] = a->w[from + j];
        heard[2 * m + j] = a->w_dot[from + j];
    }
}

/* Of W and its first two derivatives: w = W' + leak W, and so on. */
static void without_leak(const Quantities *a, double *heard) {
    for (int j = 0; j < m; j++) {
        heard[2 * m + j] += a->leak[j] * heard[m + j];
        heard[m + j] += a->leak[j] * heard[j];
    }
}

/* The last message, extrapolated for a time that is 0 if it is held. */
static void told(const Cell *c, const Quantities *a, int link, double age, double *heard) {
    const double *W = a->memory + c->exchange.held + (size_t)link * 3 * m;
    for (int j = 0; j < m; j++) {
        double w = W[m + j], w_dot = W[2 * m + j], W_dot = w - a->leak[j] * W[j];
        heard[j] = W[j] + age * W_dot + 0.5 * age * age * (w_dot - a->leak[j] * W_dot);
        heard[m + j] = w + age * w_dot;
        heard[2 * m + j] = w_dot;
    }
}

static double age(const Cell *c, const Quantities *a, int link, double t) {
    double found = t - a->memory[c->exchange.stamp + link];
    return found < 0 ? 0 : found > c->exchange.horizon ? c->exchange.horizon : found;
}

/* F'' of one number of the filters */
static double accelerate(const Cell *c, const Quantities *a, int number) {
    const Exchange *x = &c->exchange;
    double apart = a->memory[x->held + number] - a->memory[x->F + number];
    return x->omega * x->omega * apart - 2 * x->omega * a->memory[x->F_dot + number];
}

static void filtered(const Cell *c, const Quantities *a, int link, double *heard) {
    const Exchange *x = &c->exchange;
    for (int j = 0; j < m; j++) {
        int number = link * m + j;
        heard[j] = a->memory[x->F + number];
        heard[m + j] = a->memory[x->F_dot + number];
        heard[2 * m + j] = accelerate(c, a, number);
    }
    without_leak(a, heard);
}

/* A polynomial through W, W' and W'' at both ends of a step of the grid, and its derivatives, a share u of it on. */
static void between(const Exchange *x, const double *ends[2], double u, double *heard) {
    for (int j = 0; j < m; j++) {
        double value = 0, slope = 0, bend = 0; /* Horner's scheme */
        for (int p = 5; p >= 0; p--) {
            double coefficient = 0;
            for (int k = 0; k < 6; k++) coefficient += x->hermite[6 * p + k] * ends[k / 3][k % 3 * m + j];
            bend = bend * u + 2 * slope;
            slope = slope * u + value;
            value = value * u + coefficient;
        }
        heard[j] = value;
        heard[m + j] = slope / x->grid;
        heard[2 * m + j] = bend / (x->grid * x->grid);
    }
}

/* What was so a while ago; before the beginning W = t w with the w of then. */
static void delayed(const Cell *c, const Quantities *a, int link, double t, double *heard) {
    const Exchange *x = &c->exchange;
    double since = a->memory[x->since], then = t - x->delay[link];
    if (t < since + x->delay[link]) {
        const double *w = a->memory + x->first + (size_t)x->sender[link] * m;
        for (int j = 0; j < m; j++) { heard[j] = (then - since) * w[j]; heard[m + j] = w[j]; heard[2 * m + j] = 0; }
    } else {
        const double *kept = a->memory + x->kept + (size_t)x->sender[link] * 3 * m;
        double before = floor(then / x->grid - x->near); /* -1 at the beginning */
        size_t places = x->places, place = before + x->places, one = (size_t)c->n * 3 * m;
        between(x, (const double *[]){ kept + place % places * one, kept + (place + 1) % places * one },
                then / x->grid - before, heard);
    }
    without_leak(a, heard);
}

static void believe(const Cell *c, const Quantities *a, int link, double t, double *heard) {
    int hearing = c->exchange.hearing;
    if (hearing == HOLD) told(c, a, link, 0, heard);
    else if (hearing == EXTRAPOLATE) told(c, a, link, age(c, a, link, t), heard);
    else if (hearing == FILTER) filtered(c, a, link, heard);
    else if (hearing == DELAYED && c->exchange.delay[link] > 0) delayed(c, a, link, t, heard);
    else at_once(c, a, link, heard);
}

/* E_i = L_ii W_i + sum_j A_ij W_j over the links i <- j, and so on for sigma with w and sigma' with w' */
static void listen(const Cell *c, Quantities *a, double t) {
    const Exchange *x = &c->exchange;
    double heard[3 * m];
    for (int i = 0; i < c->n; i++) {
        size_t row = (size_t)i * m;
        const double *own[] = { a->memory + row, a->w + row, a->w_dot + row };
        double *shares[] = { a->E + row, a->sigma + row, a->sigma_dot + row };
        for (int k = 0; k < 3; k++)
            for (int j = 0; j < m; j++) shares[k][j] = x->own[i] * own[k][j];
        for (int link = x->links[i]; link < x->links[i + 1]; link++) {
            believe(c, a, link, t, heard);
            for (int k = 0; k < 3; k++)
                for (int j = 0; j < m; j++) shares[k][j] += x->weight[link] * heard[k * m + j];
        }
    }
}

/* epsilon = S w and epsilon' = S w' per pair, and what every robot knows of them at time t */
static void exchange(const Cell *c, Quantities *a, double t) {
    compare(c, a->w, a->epsilon);
    compare(c, a->w_dot, a->epsilon_dot);
    if (c->exchange.hearing == IDEAL) distribute(c, a);
    else listen(c, a, t);
}

/* The rate of the memory; what is not written here stays 0. */
static void remember(const Cell *c, Quantities *a) {
    const Exchange *x = &c->exchange;
    if (x->hearing == IDEAL) {
        for (int j = 0; j < c->p * m; j++) a->memory_dot[j] = a->epsilon[j] - a->leak[j % m] * a->integral[j];
        return;
    }
    for (int j = 0; j < c->n * m; j++) a->memory_dot[j] = a->w[j] - a->leak[j % m] * a->memory[j];
    if (x->hearing != FILTER) return;
    for (int number = 0; number < x->links[c->n] * m; number++) {
        a->memory_dot[x->F + number] = a->memory[x->F_dot + number];
        a->memory_dot[x->F_dot + number] = accelerate(c, a, number);
    }
}

