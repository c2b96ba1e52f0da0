/* The closed loop of a cell, from step to step.
 *
 * Above this text stands `network.c`, and above that the sizes of rows (m, nv, P, Z, K, bodies, tip, ...), marks of
 * steps, lists of quantities, the structures, and the generated functions of each kind of robot with the table `kinds`;
 * see structs.py. What the quantities are is said in quantities.py. Arrays are row-major and have one row per robot or
 * pair; rows are padded to the largest robot. The state y is made of the quantities in STATE, one after another; what
 * stands behind them is changed by events alone, between two calls.
 */

#include <math.h>
#include <string.h>

#define COUNT(name, rows, columns) +c->rows * (columns)
static int state_size(const Cell *c) { return 0 STATE(COUNT); }
static int controlled(const Cell *c) { return 2 * c->n * nv; } /* where in y begins what is held between samples */

/* Point at the parts of a state and of its rate. */
static void place(const Cell *c, Quantities *a, const double *y, double *y_dot) {
    double *at = (double *)y; /* no generated function writes to the state */
#define PLACE(name, rows, columns) a->name = at; at += (size_t)c->rows * (columns);
    STATE(PLACE)
    at = y_dot;
    RATE(PLACE)
}

/* Point at what is desired at a stage of a step; stage 0: start, 1: middle, 2: end. */
static void look_up(Quantities *a, const Steps *s, int stage, int step) {
    long row = (long)stage * s->length + s->first + step;
#define LOOK_UP(name, rows, columns) a->name = (double *)s->name.values + row * s->name.stride;
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

/* call_measure(c, a, i, k) and so on: the generated functions, for robot i */
#define ROW_n i
#define ROW_one 0
#define ROW_o 0
#define READ(name, rows, columns) *arg++ = a->name + (size_t)ROW_##rows * (columns);
#define WRITE(name, rows, columns) *res++ = a->name + (size_t)ROW_##rows * (columns);
#define CALL(function)                                                                      \
    static void call_##function(const Cell *c, const Quantities *a, int i, const Work *k) { \
        const double **arg = k->arg;                                                        \
        double **res = k->res;                                                              \
        function##_INPUTS(READ) function##_OUTPUTS(WRITE)                                   \
        kinds[c->kind[i]].function(k->arg, k->res, k->iw, k->w, 0);                         \
    }
FUNCTIONS(CALL)

/* What reaches a joint of the torque that is asked for, as `Plant.applied`; what is no number stays so. */
static double applied(double tau, double limit) { return tau > limit ? limit : tau < -limit ? -limit : tau; }

/* Sines and cosines, on which all else depends. */
static void turn(const Cell *c, Quantities *a) {
    for (int j = 0; j < c->n * nv; j++) { a->sine[j] = sin(a->q[j]); a->cosine[j] = cos(a->q[j]); }
}

/* What hands that hold an object do to it, and it to them: all of this follows from the state. */
static void feel(const Cell *c, Quantities *a, Work *k) {
    for (int j = 0; j < c->o * 6; j++) a->lift[j] = 0;
    for (int i = 0; i < c->n; i++) {
        if (!kinds[c->kind[i]].hand) continue;
        call_hand(c, a, i, k);
        for (int j = 0; j < 6; j++) a->lift[j] += a->wrench[i * 6 + j];
    }
}

/* Let hands that hold an object pull at their robots, and all of them move it. */
static void hold(const Cell *c, Quantities *a, Work *k) {
    for (int i = 0; i < c->n; i++)
        for (int j = 0; kinds[c->kind[i]].hand && j < nv; j++) a->moving[i * nv + j] += a->pull[i * nv + j];
    call_object(c, a, c->n, k);
}

/* What motors with a lag and a ripple give at time t, of the goal that they have, as `Drive.torque`. */
static void drive(const Cell *c, Quantities *a, double t) {
    double order = a->ripple_wave[0], phase = a->ripple_wave[1];
    for (int j = 0; j < c->n * nv; j++) {
        double smooth = a->goal[j] + a->owed[j] * exp((a->switched[0] - t) * a->lag[j]);
        a->driven[j] = smooth * (1 + a->ripple[j] * sin(order * a->q[j] + phase));
    }
}

/* v' under a torque that is asked for, where sine and cosine are known, and q' = v */
static void move(const Cell *c, Quantities *a, const double *tau, Work *k) {
    int joints = c->n * nv;
    memcpy(a->q_dot, a->v, sizeof(double) * joints);
    for (int j = 0; j < joints; j++)
        a->moving[j] = (c->saturates ? applied(tau[j], a->limits[j]) : tau[j]) + a->disturbance[j];
    if (c->rubs)
        for (int j = 0; j < joints; j++)
            a->moving[j] -= a->viscous[j] * a->v[j] + a->coulomb[j] * tanh(a->v[j] / a->smoothing[j]);
    if (c->o) hold(c, a, k);
    for (int i = 0; i < c->n; i++) call_plant(c, a, i, k);
}

/* How y' is found, in a stage of a step. */
typedef void Rate(const Cell *c, Quantities *a, Work *k, const Steps *s, int stage, int step, const double *y,
                  double *y_dot);

/* What the controller makes of motion, of what hands feel, and of what is desired. */
static void command(const Cell *c, Quantities *a, Work *k, double t) {
    for (int i = 0; i < c->n; i++) call_measure(c, a, i, k);
    exchange(c, a, t);
    for (int i = 0; i < c->n; i++) call_control(c, a, i, k);
    remember(c, a);
}

/* of the whole loop */
static void evaluate(const Cell *c, Quantities *a, Work *k, const Steps *s, int stage, int step, const double *y,
                     double *y_dot) {
    place(c, a, y, y_dot);
    look_up(a, s, stage, step);
    if (c->o) { turn(c, a); feel(c, a, k); }
    command(c, a, k, instant(s, stage, step));
    move(c, a, a->tau, k);
}

/* between samples: only the plant moves on */
static void coast(const Cell *c, Quantities *a, Work *k, const Steps *s, int stage, int step, const double *y,
                  double *y_dot) {
    place(c, a, y, y_dot);
    turn(c, a);
    if (c->o) feel(c, a, k);
    memcpy(y_dot + controlled(c), k->held + controlled(c), sizeof(double) * (state_size(c) - controlled(c)));
    if (s->act) drive(c, a, instant(s, stage, step));
    move(c, a, s->act ? a->driven : a->acting, k);
}

/* From here on acts what the controller asks for here. */
static void sample(const Cell *c, Quantities *a, Work *k, const Steps *s) {
    memcpy(a->acting, a->tau, sizeof(double) * c->n * nv);
    if (!s->holds) return;
    memcpy(k->held, k->k[0], sizeof(double) * state_size(c));
    memcpy(a->z_sampled, a->z, sizeof(double) * c->n * Z);
    memcpy(a->z_dot_sampled, a->z_dot, sizeof(double) * c->n * Z);
    a->since[0] = s->period;
}

/* A sample of what sensors measure, while hands feel what they do; whether that failed. */
static int perceive(const Cell *c, Quantities *a, Work *k, const Steps *s, int step, const double *y) {
    size_t joints = sizeof(double) * c->n * nv;
    if (s->sense(s->t[step], s->t[step], 1)) return 1;
    place(c, a, y, k->k[0]);
    look_up(a, s, 0, step);
    if (c->o) { turn(c, a); feel(c, a, k); }
    memcpy(k->stage, y, sizeof(double) * state_size(c));
    place(c, a, k->stage, k->k[0]);
    memcpy(a->q, a->measured_q, joints);
    memcpy(a->v, a->measured_v, joints);
    command(c, a, k, s->t[step]);
    sample(c, a, k, s);
    return 0;
}

/* Let actuators act on what is asked for; whether that failed. */
static int actuate(const Cell *c, Quantities *a, const Steps *s, int step) {
    if (s->act(s->t[step], instant(s, 1, step), (s->marks[step] & SAMPLED) != 0)) return 1;
    drive(c, a, s->t[step]);
    return 0;
}

/* One row of the log, of an instant at which the loop was evaluated. */
static void record(const Cell *c, Quantities *a, Work *k, long row, const Log *log) {
    for (int i = 0; i < c->n; i++)
        if (kinds[c->kind[i]].estimate) call_estimate(c, a, i, k);
        else memcpy(a->theta_hat + (size_t)i * P, a->z + (size_t)i * Z, sizeof(double) * P);
    if (c->exchange.hearing != IDEAL) compare(c, a->memory, a->integral); /* S W */
#define COPY(log_name, name, rows, columns) \
    if (log->log_name) \
        memcpy(log->log_name + row * c->rows * (columns), a->name, sizeof(double) * c->rows * (columns));
    LOGS(COPY)
}

/* The tests of the guard of the reference engine, in its order; each looks at all robots before the next one. */

static int found(Report *report, int status, int robot, double value) {
    report->status = status;
    report->robot = robot;
    report->value = value;
    return 1;
}

static int not_finite(const double *numbers, int size) {
    for (int j = 0; j < size; j++)
        if (!isfinite(numbers[j])) return 1;
    return 0;
}

/* The first robot of which a watched number has reached its bound, or is none; number by number. */
static int beyond(const Cell *c, const Quantities *a, Report *report) {
    for (int k = 0; k < watches; k++)
        for (int i = 0; i < c->n; i++) {
            double value = a->watched[i * watches + k];
            if (!(value < a->bounds[k])) return found(report, FOUND_STATE + 1 + k, i, value);
        }
    return 0;
}

/* The first robot on the other side of a singular configuration than at the last checked instant. */
static int crossed(const Cell *c, const Quantities *a, Work *k, Report *report) {
    for (int i = 0; watches && i < c->n; i++) {
        double side = a->side[i], before = k->side[i];
        k->side[i] = side;
        if ((side < 0 && before > 0) || (side > 0 && before < 0)) return found(report, FOUND_SIDE, i, 0);
    }
    return 0;
}

static int check(const Cell *c, const Quantities *a, Work *k, const double *y, Report *report) {
    if (not_finite(y, state_size(c))) return found(report, FOUND_STATE, 0, 0);
    for (int i = 0; watches && i < c->n; i++) call_guard(c, a, i, k);
    if (beyond(c, a, report) || crossed(c, a, k, report)) return 1;
    for (int i = 0; i < c->n; i++)
        if (not_finite(a->tau + (size_t)i * nv, nv)) return found(report, FOUND_TORQUE, i, 0);
    return 0;
}

static void note(StepError *worst, double error, double t, int joint) {
    if (!(error > worst->largest) || !isfinite(error)) return;
    worst->largest = error;
    worst->time = t;
    worst->at = joint;
}

/* The step that ended at t, as `StepError` of step_error.py judges it: by the derivatives k4 and k1 on both sides
 * of t, and by Simpson's rule over two steps. h = 0 where it cannot be judged. */
static void look_back(const Cell *c, double t, double h, const double *y, const double *k4, const double *k1,
                      StepError *w) {
    int size = c->n * nv;
    int equal = h > 0 && fabs(h - w->h_before) <= 1e-6 * h;
    for (int j = 0; j < size; j++) {
        double v = y[size + j], a = k1[size + j], *vs = w->v + j, *as = w->a + j;
        if (fabs(v) > w->speed && isfinite(v)) w->speed = fabs(v);
        note(w, h / 6 * fabs(k4[size + j] - a), t, j);
        if (equal) note(w, fabs(v - vs[0] - h / 3 * (as[0] + 4 * as[size] + a)), t, j);
        vs[0] = vs[size];
        vs[size] = v;
        as[0] = as[size];
        as[size] = a;
    }
    w->h_before = h;
}

static void combine(double *out, const double *y, double h, const double *slope, int size) {
    for (int j = 0; j < size; j++) out[j] = y[j] + h * slope[j];
}

/* One step of the classical Runge-Kutta method from y, whose first slope is at hand. */
static void runge_kutta(const Cell *c, Quantities *a, Work *k, const Steps *s, Rate *rate, int step, double h,
                        double *y) {
    static const int stages[] = { 0, 1, 1, 2 };
    double *const *slope = k->k;
    int size = state_size(c);
    for (int i = 1; i < 4; i++) {
        combine(k->stage, y, i < 3 ? 0.5 * h : h, slope[i - 1], size);
        rate(c, a, k, s, stages[i], step, k->stage, slope[i]);
    }
    for (int j = 0; j < size; j++)
        y[j] += h / 6 * (slope[0][j] + 2 * (slope[1][j] + slope[2][j]) + slope[3][j]);
}

/* Let adaptations make of their state what they do after a step or a sample, before anything is asked about it. */
static void settle(const Cell *c, Quantities *a, Work *k, double *y) {
    place(c, a, y, k->k[0]);
    for (int i = 0; i < c->n; i++) {
        const double *z = NULL;
        if (kinds[c->kind[i]].leap && a->since[0] > 0) {
            call_leap(c, a, i, k);
            z = a->leapt;
        } else if (kinds[c->kind[i]].settle) {
            call_settle(c, a, i, k);
            z = a->settled;
        }
        if (z) memcpy(a->z + (size_t)i * Z, z + (size_t)i * Z, sizeof(double) * Z);
    }
}

/* All that happens at the start of a step, before time goes on; whether the run ends here. With continuous control
 * every step begins with a sample. */
static int begin(const Cell *c, Quantities *a, Work *k, const Steps *s, int step, double *y, const Log *log,
                 Report *report) {
    int marks = s->marks[step], senses = marks & SAMPLED && s->sense;
    report->step = step;
    take(a, s, step);
    if (marks & SAMPLED) settle(c, a, k, y);
    if (senses && perceive(c, a, k, s, step, y)) return 1;
    if (marks & (CHECKED | SAMPLED)) evaluate(c, a, k, s, 0, step, y, k->k[0]);
    if (senses) memcpy(a->tau, a->acting, sizeof(double) * c->n * nv);
    if (!s->holds)
        look_back(c, s->t[step], marks & JOINED ? k->step_error.h : 0, y, k->k[3], k->k[0], &k->step_error);
    if (marks & CHECKED && check(c, a, k, y, report)) return 1;
    if (marks & SAMPLED && !senses) sample(c, a, k, s);
    if (s->act && actuate(c, a, s, step)) return 1;
    if (marks & LOGGED) record(c, a, k, report->rows++, log);
    return 0;
}

/* Look at a step that has ended, by what the torque that was held through it does there: it may jump now. */
static void look_at_end(const Cell *c, Quantities *a, Work *k, const Steps *s, int step, double h, const double *y) {
    coast(c, a, k, s, 2, step, y, k->k[0]);
    look_back(c, s->t[step + 1], h, y, k->k[3], k->k[0], &k->step_error);
    k->step_error.h_before = 0;
}

/* Advance y through some steps; rows are counted in the report. */
void advance(const Cell *c, Quantities *a, Work *k, const Steps *s, double *y, const Log *log, Report *report) {
    Rate *rate = s->holds ? coast : evaluate;
    for (int step = 0; step < s->count; step++) {
        double h = s->t[step + 1] - s->t[step];
        if (begin(c, a, k, s, step, y, log, report)) return;
        if (s->holds) coast(c, a, k, s, 0, step, y, k->k[0]);
        runge_kutta(c, a, k, s, rate, step, h, y);
        k->step_error.h = h;
        if (s->holds) look_at_end(c, a, k, s, step, h, y);
    }
}

/* y' at one instant */
void state_dot(const Cell *c, Quantities *a, Work *k, const Steps *s, const double *y, double *y_dot) {
    take(a, s, 0);
    evaluate(c, a, k, s, 0, 0, y, y_dot);
}

/* The largest scratch arrays that a generated function asks for: arg, res, iw, w. */
void work_sizes(long long *largest) {
    for (int j = 0; j < 4; j++) largest[j] = 0;
#define GROW(function) \
    if (kinds[i].function) { \
        kinds[i].function##_work(need, need + 1, need + 2, need + 3); \
        for (int j = 0; j < 4; j++) \
            if (need[j] > largest[j]) largest[j] = need[j]; \
    }
    for (int i = 0; i < KINDS; i++) {
        long long need[4];
        FUNCTIONS(GROW)
    }
}
