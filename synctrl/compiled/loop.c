/* The closed loop of a cell, from step to step.
 *
 * Above this text stands `network.c`, and above that the sizes of rows (m, nv, P, Z, K, bodies, tip, ...), marks of
 * steps, lists of quantities, the structures, and the generated functions of each kind of robot with the table `kinds`;
 * see structs.py. What the quantities are is said in quantities.py. Arrays are row-major and have one row per robot or
 * pair; rows are padded to the largest robot. The state y is made of the quantities in STATE, one after another; what
 * stands behind them is changed by events alone, between two calls.
 *
 * Every number is a `vec`, see vectors.h, of as many lanes as LANES. Lanes are either runs that are made side by side,
 * or robots of one run: then a row is one of LANES robots, or pairs, and lanes that are too many repeat the last one.
 */

#define COUNT(name, rows, columns) +c->rows * (columns)
static int state_size(const Cell *c) { return 0 STATE(COUNT); }
static int controlled(const Cell *c) { return 2 * c->n * nv; } /* where in y begins what is held between samples */

/* Point at the parts of a state and of its rate. */
static void place(const Cell *c, Quantities *a, const vec *y, vec *y_dot) {
    vec *at = (vec *)y; /* no generated function writes to the state */
#define PLACE(name, rows, columns) a->name = at; at += (size_t)c->rows * (columns);
    STATE(PLACE)
    at = y_dot;
    RATE(PLACE)
}

/* A row of arrays; what all lanes share is spread over them. */
INSIDE vec *at_row(const Arrays *x, long row) {
    if (!x->spread) return x->values + row * x->stride;
    const double *shared = (const double *)x->values + row * x->stride;
    for (long j = 0; j < x->stride; j++) x->spread[j] = splat(shared[j]);
    return x->spread;
}

/* Point at what is desired at a stage of a step; stage 0: start, 1: middle, 2: end. Rows are those of all starts and of
 * the last end, then those of the middles; see `DesiredStretch`. */
static void look_up(Quantities *a, const Steps *s, int stage, int step) {
    long place = s->first + step, row = stage == 0 ? place : stage == 1 ? s->length + 1 + place : s->ends[place];
#define LOOK_UP(name, rows, columns) a->name = at_row(&s->name, row);
    INSTANT(LOOK_UP)
}

/* The instant of a stage, s; what is asked for at the end of a step is asked just before it. */
static double instant(const Steps *s, int stage, int step) {
    double t = s->t[step], t_next = s->t[step + 1];
    return stage == 0 ? t : stage == 1 ? 0.5 * (t + t_next) : nextafter(t_next, -INFINITY);
}

/* Let the robots carry, and feel from outside, what they do in a step. */
static void take(Quantities *a, const Steps *s, int step) {
    long row = s->disturbed[step];
    DISTURBANCE(LOOK_UP)
    row = s->loaded[step];
    LOAD(LOOK_UP)
}

/* call_measure(c, a, i) and so on: the generated functions, for robot i */
#define CALL(function) \
    static void call_##function(const Cell *c, const Quantities *a, int i) { kinds[c->kind[i]].function(a, i); }
FUNCTIONS(CALL)

/* What reaches a joint of the torque that is asked for, as `Plant.applied`; what is no number stays so. */
static vec applied(vec tau, vec limit) {
    return choose(is_less(limit, tau), limit, choose(is_less(tau, -limit), -limit, tau));
}

/* Sines and cosines, on which all else depends. */
static void turn(const Cell *c, Quantities *a) {
    sines((const double *)a->q, (double *)a->sine, (double *)a->cosine, (long)c->n * nv * LANES);
}

/* Add the wrench of one hand to what all of them do: of every robot in a lane, one after another. */
static void lift(const Cell *c, Quantities *a, int i) {
    for (int j = 0; j < 6; j++) {
        vec one = a->wrench[i * 6 + j];
        if (!c->scattered) { a->lift[j] += one; continue; }
        double sum = lane(a->lift[j], 0);
        for (int l = 0; l < LANES && i * LANES + l < c->robots; l++) sum += lane(one, l);
        a->lift[j] = splat(sum);
    }
}

/* What hands that hold an object do to it, and it to them: all of this follows from the state. */
static void feel(const Cell *c, Quantities *a) {
    for (int j = 0; j < c->o * 6; j++) a->lift[j] = splat(0);
    for (int i = 0; i < c->n; i++) {
        if (!kinds[c->kind[i]].hand) continue;
        call_hand(c, a, i);
        lift(c, a, i);
    }
}

/* Let hands that hold an object pull at their robots, and all of them move it. */
static void hold(const Cell *c, Quantities *a) {
    for (int i = 0; i < c->n; i++)
        for (int j = 0; kinds[c->kind[i]].hand && j < nv; j++) a->moving[i * nv + j] += a->pull[i * nv + j];
    call_object(c, a, c->n);
}

/* What motors with a lag and a ripple give at time t, of the goal that they have, as `Drive.torque`. */
static void drive(const Cell *c, Quantities *a, double t) {
    vec order = a->ripple_wave[0], phase = a->ripple_wave[1], since = a->switched[0] - splat(t);
    for (int j = 0; j < c->n * nv; j++) {
        vec smooth = a->goal[j] + a->owed[j] * v_exp(since * a->lag[j]);
        a->driven[j] = smooth * (splat(1) + a->ripple[j] * v_sin(order * a->q[j] + phase));
    }
}

/* v' under a torque that is asked for, where sine and cosine are known, and q' = v */
static void move(const Cell *c, Quantities *a, const vec *tau) {
    int joints = c->n * nv;
    for (int j = 0; j < joints; j++) a->q_dot[j] = a->v[j];
    for (int j = 0; j < joints; j++)
        a->moving[j] = (c->saturates ? applied(tau[j], a->limits[j]) : tau[j]) + a->disturbance[j];
    if (c->rubs) {
        const vec *rows[] = { a->v, a->viscous, a->coulomb, a->smoothing };
        const double *const *of = (const double *const *)rows;
        rub((double *)a->moving, of[0], of[1], of[2], of[3], (long)joints * LANES);
    }
    if (c->o) hold(c, a);
    for (int i = 0; i < c->n; i++) call_plant(c, a, i);
}

/* How y' is found, in a stage of a step. */
typedef void Rate(const Cell *c, Quantities *a, Work *k, const Steps *s, int stage, int step, const vec *y,
                  vec *y_dot);

/* What the controller makes of motion, of what hands feel, and of what is desired. */
static void command(const Cell *c, Quantities *a, double t) {
    for (int i = 0; i < c->n; i++) call_measure(c, a, i);
    exchange(c, a, t);
    for (int i = 0; i < c->n; i++) call_control(c, a, i);
    remember(c, a);
}

/* of the whole loop */
static void evaluate(const Cell *c, Quantities *a, Work *k, const Steps *s, int stage, int step, const vec *y,
                     vec *y_dot) {
    (void)k;
    place(c, a, y, y_dot);
    look_up(a, s, stage, step);
    turn(c, a);
    if (c->o) feel(c, a);
    command(c, a, instant(s, stage, step));
    move(c, a, a->tau);
}

/* between samples: only the plant moves on */
static void coast(const Cell *c, Quantities *a, Work *k, const Steps *s, int stage, int step, const vec *y,
                  vec *y_dot) {
    place(c, a, y, y_dot);
    turn(c, a);
    if (c->o) feel(c, a);
    memcpy(y_dot + controlled(c), k->held + controlled(c), sizeof(vec) * (state_size(c) - controlled(c)));
    if (s->act) drive(c, a, instant(s, stage, step));
    move(c, a, s->act ? a->driven : a->acting);
}

/* From here on acts what the controller asks for here. */
static void sample(const Cell *c, Quantities *a, Work *k, const Steps *s) {
    memcpy(a->acting, a->tau, sizeof(vec) * c->n * nv);
    if (!s->holds) return;
    memcpy(k->held, k->k[0], sizeof(vec) * state_size(c));
    memcpy(a->z_sampled, a->z, sizeof(vec) * c->n * Z);
    memcpy(a->z_dot_sampled, a->z_dot, sizeof(vec) * c->n * Z);
    a->since[0] = splat(s->period);
}

/* A sample of what sensors measure, while hands feel what they do; whether that failed. */
static int perceive(const Cell *c, Quantities *a, Work *k, const Steps *s, int step, const vec *y) {
    size_t joints = sizeof(vec) * c->n * nv;
    if (s->sense(s->t[step], s->t[step], 1)) return 1;
    place(c, a, y, k->k[0]);
    look_up(a, s, 0, step);
    if (c->o) { turn(c, a); feel(c, a); }
    memcpy(k->stage, y, sizeof(vec) * state_size(c));
    place(c, a, k->stage, k->k[0]);
    memcpy(a->q, a->measured_q, joints);
    memcpy(a->v, a->measured_v, joints);
    turn(c, a);
    command(c, a, s->t[step]);
    sample(c, a, k, s);
    return 0;
}

/* Let actuators act on what is asked for; whether that failed. */
static int actuate(const Cell *c, Quantities *a, const Steps *s, int step) {
    if (s->act(s->t[step], instant(s, 1, step), (s->marks[step] & SAMPLED) != 0)) return 1;
    drive(c, a, s->t[step]);
    return 0;
}

