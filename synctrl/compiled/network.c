/* What robots hear of each other: the synchronization errors of pairs, and every robot's shares of them.
 *
 * With the ideal network the memory is the integrals of epsilon. With the others it begins with W, one row per robot,
 * and goes on with parts of which `Exchange` says where they begin; see links.py, receivers.py and delayed.py. What
 * messages say is written into it between two calls. Messages change, and only W and filters flow.
 *
 * Where lanes are robots, who is compared with whom may be in other lanes: there one is fetched lane by lane. Networks
 * other than the ideal one never have robots in lanes.
 */

/* sum += sign times the row of a robot, or pair, that a term speaks of; one row per lane, see `Cell`. */
INSIDE void add(const Cell *c, vec *sum, vec sign, const vec *rows, const int *places) {
    const double *numbers = (const double *)rows;
    if (!c->scattered)
        for (int j = 0; j < m; j++) sum[j] += sign * load(numbers + places[0] + j * LANES);
    else if (c->n == 1 && c->p == 1) /* one row of robots, and one of pairs */
        for (int j = 0; j < m; j++) sum[j] += sign * permuted(rows[j], places);
    else
        for (int j = 0; j < m; j++) sum[j] += sign * gather(numbers + j * LANES, places);
}

/* S times rows of robots: one row per pair. */
static void compare(const Cell *c, const vec *rows, vec *epsilon) {
    for (int pair = 0; pair < c->p; pair++, epsilon += m) {
        vec sum[m] = { 0 };
        for (int t = pair * c->arity; t < (pair + 1) * c->arity; t++)
            add(c, sum, c->sign[t], rows, c->edge + t * LANES);
        memcpy(epsilon, sum, sizeof sum);
    }
}

/* E, sigma, sigma' = S^T (integral, epsilon, epsilon') per robot */
static void distribute(const Cell *c, Quantities *a) {
    a->integral = a->memory;
    for (int i = 0; i < c->n; i++) {
        vec E[m] = { 0 }, sigma[m] = { 0 }, sigma_dot[m] = { 0 };
        for (int t = c->first[i]; t < c->first[i + 1]; t++) {
            const int *pair = c->incident + t * LANES;
            vec sign = c->incident_sign[t];
            add(c, E, sign, a->integral, pair);
            add(c, sigma, sign, a->epsilon, pair);
            add(c, sigma_dot, sign, a->epsilon_dot, pair);
        }
        memcpy(a->E + i * m, E, sizeof E);
        memcpy(a->sigma + i * m, sigma, sizeof sigma);
        memcpy(a->sigma_dot + i * m, sigma_dot, sizeof sigma_dot);
    }
}

/* What is believed of W, w and w' of who is heard on a link, one row after another. */

static void at_once(const Cell *c, const Quantities *a, int link, vec *heard) {
    size_t from = (size_t)c->exchange.sender[link] * m;
    for (int j = 0; j < m; j++) {
        heard[j] = a->memory[from + j];
        heard[m + j] = a->w[from + j];
        heard[2 * m + j] = a->w_dot[from + j];
    }
}

/* Of W and its first two derivatives: w = W' + leak W, and so on. */
static void without_leak(const Quantities *a, vec *heard) {
    for (int j = 0; j < m; j++) {
        heard[2 * m + j] += a->leak[j] * heard[m + j];
        heard[m + j] += a->leak[j] * heard[j];
    }
}

/* The last message, extrapolated for a time that is 0 if it is held. */
static void told(const Cell *c, const Quantities *a, int link, vec age, vec *heard) {
    const vec *W = a->memory + c->exchange.held + (size_t)link * 3 * m;
    for (int j = 0; j < m; j++) {
        vec w = W[m + j], w_dot = W[2 * m + j], W_dot = w - a->leak[j] * W[j];
        heard[j] = W[j] + age * W_dot + splat(0.5) * age * age * (w_dot - a->leak[j] * W_dot);
        heard[m + j] = w + age * w_dot;
        heard[2 * m + j] = w_dot;
    }
}

static vec age(const Cell *c, const Quantities *a, int link, double t) {
    vec found = splat(t) - a->memory[c->exchange.stamp + link], none = splat(0), most = splat(c->exchange.horizon);
    return choose(is_less(found, none), none, choose(is_less(most, found), most, found));
}

/* F'' of one number of the filters */
static vec accelerate(const Cell *c, const Quantities *a, int number) {
    const Exchange *x = &c->exchange;
    vec apart = a->memory[x->held + number] - a->memory[x->F + number];
    return splat(x->omega * x->omega) * apart - splat(2 * x->omega) * a->memory[x->F_dot + number];
}

static void filtered(const Cell *c, const Quantities *a, int link, vec *heard) {
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
static void between(const Exchange *x, const vec *ends[2], double u, vec *heard) {
    for (int j = 0; j < m; j++) {
        vec value = splat(0), slope = splat(0), bend = splat(0), on = splat(u); /* Horner's scheme */
        for (int p = 5; p >= 0; p--) {
            vec coefficient = splat(0);
            for (int k = 0; k < 6; k++) coefficient += splat(x->hermite[6 * p + k]) * ends[k / 3][k % 3 * m + j];
            bend = bend * on + splat(2) * slope;
            slope = slope * on + value;
            value = value * on + coefficient;
        }
        heard[j] = value;
        heard[m + j] = slope / splat(x->grid);
        heard[2 * m + j] = bend / splat(x->grid * x->grid);
    }
}

/* What was so a while ago; before the beginning W = t w with the w of then. */
static void delayed(const Cell *c, const Quantities *a, int link, double t, vec *heard) {
    const Exchange *x = &c->exchange;
    double since = lane(a->memory[x->since], 0), then = t - x->delay[link];
    if (t < since + x->delay[link]) {
        const vec *w = a->memory + x->first + (size_t)x->sender[link] * m;
        for (int j = 0; j < m; j++) {
            heard[j] = splat(then - since) * w[j];
            heard[m + j] = w[j];
            heard[2 * m + j] = splat(0);
        }
    } else {
        const vec *kept = a->memory + x->kept + (size_t)x->sender[link] * 3 * m;
        double before = floor(then / x->grid - x->near); /* -1 at the beginning */
        size_t places = x->places, place = before + x->places, one = (size_t)c->n * 3 * m;
        between(x, (const vec *[]){ kept + place % places * one, kept + (place + 1) % places * one },
                then / x->grid - before, heard);
    }
    without_leak(a, heard);
}

static void believe(const Cell *c, const Quantities *a, int link, double t, vec *heard) {
    int hearing = c->exchange.hearing;
    if (hearing == HOLD) told(c, a, link, splat(0), heard);
    else if (hearing == EXTRAPOLATE) told(c, a, link, age(c, a, link, t), heard);
    else if (hearing == FILTER) filtered(c, a, link, heard);
    else if (hearing == DELAYED && c->exchange.delay[link] > 0) delayed(c, a, link, t, heard);
    else at_once(c, a, link, heard);
}

/* E_i = L_ii W_i + sum_j A_ij W_j over the links i <- j, and so on for sigma with w and sigma' with w' */
static void listen(const Cell *c, Quantities *a, double t) {
    const Exchange *x = &c->exchange;
    vec heard[3 * m];
    for (int i = 0; i < c->n; i++) {
        size_t row = (size_t)i * m;
        const vec *own[] = { a->memory + row, a->w + row, a->w_dot + row };
        vec *shares[] = { a->E + row, a->sigma + row, a->sigma_dot + row };
        for (int k = 0; k < 3; k++)
            for (int j = 0; j < m; j++) shares[k][j] = splat(x->own[i]) * own[k][j];
        for (int link = x->links[i]; link < x->links[i + 1]; link++) {
            believe(c, a, link, t, heard);
            for (int k = 0; k < 3; k++)
                for (int j = 0; j < m; j++) shares[k][j] += splat(x->weight[link]) * heard[k * m + j];
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
