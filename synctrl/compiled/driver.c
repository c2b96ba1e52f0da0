/* The closed loop of a cell, from step to step.
 *
 * The functions of each kind of robot are generated and stand above this text, with the table `kinds`. Arrays
 * are row-major and have one row per robot; rows are padded to the largest robot. The state y is
 * q (n, nv), v (n, nv), z of the adaptation (n, Z), integrals of epsilon (p, m), one after another; with (14) z is
 * theta_hat.
 */

#include <math.h>
#include <string.h>

typedef struct {
    int n, m, nv, P, Z, p, bodies; /* Z: state of the adaptation; bodies: 10 times the largest number of bodies */
    const int *kind;            /* per robot */
    const int *edge;            /* (p, arity) robots that are compared */
    const double *sign;         /* (p, arity) entries of S */
    const int *first;           /* (n + 1) where the pairs of a robot begin in `incident` */
    const int *incident;        /* pairs, robot after robot */
    const double *incident_sign;
    const double *Lambda, *beta, *K_eps; /* (m) */
    const double *K_r, *Gamma;           /* (n, K), (n, P) */
    const double *W_inv, *posture, *gain;           /* (n, nv) */
    const double *base;                             /* (n, 12) */
    const double *pi;                               /* (loads, n, bodies), true parameters with every load */
    const double *viscous, *coulomb, *smoothing;    /* (n, nv), (n, nv), (n) */
    const double *limits;                           /* (n, nv), at which torque is cut off */
    int rubs;                                       /* whether there is friction */
    int saturates;                                  /* whether torque is cut off */
    int K;                                          /* columns of K_r */
    int arity;                                      /* robots in one synchronization error */
    double max_condition, max_angle;
} Cell;

typedef struct { /* what is desired in one block of steps; stage 0: start, 1: middle, 2: end of a step */
    const double *desired; /* (3, steps, n, 3 m) */
    const double *weights; /* (3, steps, n, 4 m m), or (n, 4 m m) if constant */
    int steps, constant;
    int first, count;      /* the steps of the block to be made */
} Reference;

typedef struct { /* one row per logged instant */
    double *x, *xd, *e, *epsilon, *integral, *e_star, *q, *v, *s_q, *tau, *disturbance, *theta_hat, *z; /* z may be 0 */
} Log;

typedef struct { /* the worst step of a run: its error in velocity, largest velocity, end, and which joint */
    double largest, speed, time;
    double h, h_before; /* the last step, and the one before if it could be looked at, else 0 */
    double *v, *a;      /* (2, n nv): at the two instants before */
    int at;
} StepError;

typedef struct {
    double *w;        /* scratch of the generated functions */
    long long *iw;
    const double **arg;
    double **res;
    double *task;     /* (n, 7 m): x, e, x', xd', xd'', w, w' */
    double *trig;     /* (n, 2 nv) */
    double *J;        /* (n, 3 m nv + m m): J, J', J^-1, G */
    double *compared; /* (p, 2 m): epsilon, epsilon' */
    double *shares;   /* (n, 3 m): E, sigma, sigma' */
    double *tau;      /* (n, nv) */
    double *loaded;   /* (n, nv): torque that moves the plant */
    double *e_star, *s_q;
    const double *pi; /* (n, bodies): true parameters with what the robots carry in this step */
    double *k[4], *stage;
    double *sign;     /* (n): signs of the determinants at the last logged instant, 0 at first */
    double *held, *held_tau; /* sampled control */
    StepError *step_error;
} Work;

enum { FINE = 0, STATE = 1, TURNED = 2, SINGULAR = 3, CROSSED = 4, TORQUE = 5 };

/* what happens at the start of a step */
enum { CHECKED = 1, LOGGED = 2, SAMPLED = 4, JOINED = 8 }; /* JOINED: all goes on smoothly from the step before */

typedef struct { int status, step, robot; double value; long rows; } Report; /* rows: how many were logged */

static int state_size(const Cell *c) { return c->n * (2 * c->nv + c->Z) + c->p * c->m; }
static int J_size(const Cell *c) { return 3 * c->m * c->nv + c->m * c->m; }

static const double *weights_of(const Cell *c, const Reference *r, int stage, int step, int i) {
    int size = 4 * c->m * c->m;
    if (r->constant) return r->weights + (size_t)i * size;
    return r->weights + (((size_t)stage * r->steps + r->first + step) * c->n + i) * size;
}

static const double *desired_of(const Cell *c, const Reference *r, int stage, int step, int i) {
    return r->desired + (((size_t)stage * r->steps + r->first + step) * c->n + i) * 3 * c->m;
}

static void measure(const Cell *c, const Reference *r, int stage, int step, const double *y, Work *k) {
    int m = c->m, nv = c->nv;
    for (int i = 0; i < c->n; i++) {
        const Kind *kind = &kinds[c->kind[i]];
        double *task = k->task + (size_t)i * 7 * m, *J = k->J + (size_t)i * J_size(c);
        const double **a = k->arg;
        double **o = k->res;
        *a++ = y + (size_t)i * nv;
        *a++ = y + (size_t)(c->n + i) * nv;
        *a++ = c->base + 12 * i;
        *a++ = desired_of(c, r, stage, step, i);
        *a++ = weights_of(c, r, stage, step, i);
        *a++ = c->W_inv + (size_t)i * nv;
        for (int part = 0; part < 7; part++) *o++ = task + part * m;
        *o++ = k->trig + (size_t)i * 2 * nv;
        *o++ = k->trig + (size_t)i * 2 * nv + nv;
        for (int part = 0; part < 4; part++) *o++ = J + (size_t)part * m * nv;
        kind->measure(k->arg, k->res, k->iw, k->w, 0);
    }
}

/* epsilon = S w and epsilon' = S w' per pair; E, sigma, sigma' = S^T (integral, epsilon, epsilon') per robot */
static void couple(const Cell *c, const double *integral, Work *k) {
    int m = c->m;
    for (int pair = 0; pair < c->p; pair++) {
        double *epsilon = k->compared + (size_t)pair * 2 * m;
        memset(epsilon, 0, sizeof(double) * 2 * m);
        for (int t = pair * c->arity; t < (pair + 1) * c->arity; t++) {
            const double *w = k->task + (size_t)c->edge[t] * 7 * m + 5 * m;
            for (int j = 0; j < 2 * m; j++) epsilon[j] += c->sign[t] * w[j];
        }
    }
    memset(k->shares, 0, sizeof(double) * c->n * 3 * m);
    for (int i = 0; i < c->n; i++) {
        double *share = k->shares + (size_t)i * 3 * m;
        for (int t = c->first[i]; t < c->first[i + 1]; t++) {
            const double *pair = k->compared + (size_t)c->incident[t] * 2 * m;
            const double *sum = integral + (size_t)c->incident[t] * m;
            for (int j = 0; j < m; j++) share[j] += c->incident_sign[t] * sum[j];
            for (int j = 0; j < 2 * m; j++) share[m + j] += c->incident_sign[t] * pair[j];
        }
    }
}

static void control(const Cell *c, const Reference *r, int stage, int step, const double *y, double *y_dot,
                    Work *k) {
    int n = c->n, m = c->m, nv = c->nv;
    for (int i = 0; i < n; i++) {
        const Kind *kind = &kinds[c->kind[i]];
        double *task = k->task + (size_t)i * 7 * m, *J = k->J + (size_t)i * J_size(c);
        double *share = k->shares + (size_t)i * 3 * m, *trig = k->trig + (size_t)i * 2 * nv;
        const double **a = k->arg;
        double **o = k->res;
        *a++ = y + (size_t)i * nv;
        *a++ = y + (size_t)(n + i) * nv;
        *a++ = trig;
        *a++ = trig + nv;
        *a++ = y + (size_t)2 * n * nv + (size_t)i * c->Z;
        for (int part = 0; part < 3; part++) *a++ = share + part * m;
        for (int part = 1; part < 7; part++) *a++ = task + part * m;
        for (int part = 0; part < 4; part++) *a++ = J + (size_t)part * m * nv;
        *a++ = weights_of(c, r, stage, step, i);
        *a++ = c->Lambda;
        *a++ = c->beta;
        *a++ = c->K_eps;
        *a++ = c->K_r + (size_t)i * c->K;
        *a++ = c->Gamma + (size_t)i * c->P;
        *a++ = c->W_inv + (size_t)i * nv;
        *a++ = c->posture + (size_t)i * nv;
        *a++ = c->gain + (size_t)i * nv;
        *a++ = c->base + 12 * i;
        *o++ = k->tau + (size_t)i * nv;
        *o++ = y_dot + (size_t)2 * n * nv + (size_t)i * c->Z;
        *o++ = k->e_star + (size_t)i * m;
        *o++ = k->s_q + (size_t)i * nv;
        kind->control(k->arg, k->res, k->iw, k->w, 0);
    }
    for (int pair = 0; pair < c->p; pair++)
        memcpy(y_dot + n * (2 * nv + c->Z) + (size_t)pair * m, k->compared + (size_t)pair * 2 * m,
               sizeof(double) * m);
}

/* What reaches a joint of the torque that is asked for, as `Plant.applied`; what is no number stays so. */
static double applied(double tau, double limit) { return tau > limit ? limit : tau < -limit ? -limit : tau; }

static void plant(const Cell *c, const double *y, const double *tau, const double *disturbance, double *y_dot,
                  int fresh, Work *k) {
    int n = c->n, nv = c->nv;
    memcpy(y_dot, y + (size_t)n * nv, sizeof(double) * n * nv);
    for (int i = 0; i < n; i++) {
        const Kind *kind = &kinds[c->kind[i]];
        const double *q = y + (size_t)i * nv, *v = y + (size_t)(n + i) * nv;
        double *load = k->loaded + (size_t)i * nv, *trig = k->trig + (size_t)i * 2 * nv;
        for (int j = 0; j < nv; j++) {
            double asked = tau[i * nv + j];
            load[j] = (c->saturates ? applied(asked, c->limits[i * nv + j]) : asked) + disturbance[i * nv + j];
        }
        if (c->rubs)
            for (int j = 0; j < nv; j++)
                load[j] -= c->viscous[i * nv + j] * v[j]
                         + c->coulomb[i * nv + j] * tanh(v[j] / c->smoothing[i]);
        if (!fresh)
            for (int j = 0; j < nv; j++) { trig[j] = sin(q[j]); trig[nv + j] = cos(q[j]); }
        const double **a = k->arg;
        *a++ = q;
        *a++ = v;
        *a++ = trig;
        *a++ = trig + nv;
        *a++ = load;
        *a++ = k->pi + (size_t)i * c->bodies;
        *a++ = c->base + 12 * i;
        k->res[0] = y_dot + (size_t)(n + i) * nv;
        kind->plant(k->arg, k->res, k->iw, k->w, 0);
    }
}

static void evaluate(const Cell *c, const Reference *r, int stage, int step, const double *y,
                     const double *disturbance, double *y_dot, Work *k) {
    measure(c, r, stage, step, y, k);
    couple(c, y + c->n * (2 * c->nv + c->Z), k);
    control(c, r, stage, step, y, y_dot, k);
    plant(c, y, k->tau, disturbance, y_dot, 1, k);
}

/* y' between samples: only the plant moves on */
static void coast(const Cell *c, const double *y, const double *disturbance, double *y_dot, Work *k) {
    int controlled = 2 * c->n * c->nv;
    memcpy(y_dot + controlled, k->held + controlled, sizeof(double) * (state_size(c) - controlled));
    plant(c, y, k->held_tau, disturbance, y_dot, 0, k);
}

static void record(const Cell *c, const Reference *r, int step, long row, const double *y, const double *tau,
                   const double *disturbance, Log *log, Work *k) {
    int n = c->n, m = c->m, nv = c->nv;
    for (int i = 0; i < n; i++) {
        const double *task = k->task + (size_t)i * 7 * m;
        memcpy(log->x + (row * n + i) * m, task, sizeof(double) * m);
        memcpy(log->e + (row * n + i) * m, task + m, sizeof(double) * m);
        memcpy(log->xd + (row * n + i) * m, desired_of(c, r, 0, step, i), sizeof(double) * m);
    }
    for (int pair = 0; pair < c->p; pair++)
        memcpy(log->epsilon + (row * c->p + pair) * m, k->compared + (size_t)pair * 2 * m, sizeof(double) * m);
    memcpy(log->integral + row * c->p * m, y + n * (2 * nv + c->Z), sizeof(double) * c->p * m);
    memcpy(log->e_star + row * n * m, k->e_star, sizeof(double) * n * m);
    memcpy(log->q + row * n * nv, y, sizeof(double) * n * nv);
    memcpy(log->v + row * n * nv, y + n * nv, sizeof(double) * n * nv);
    memcpy(log->s_q + row * n * nv, k->s_q, sizeof(double) * n * nv);
    memcpy(log->tau + row * n * nv, tau, sizeof(double) * n * nv);
    memcpy(log->disturbance + row * n * nv, disturbance, sizeof(double) * n * nv);
    for (int i = 0; i < n; i++) {
        const double *z = y + 2 * (size_t)n * nv + (size_t)i * c->Z;
        double *theta_hat = log->theta_hat + (row * n + i) * c->P;
        k->arg[0] = z;
        k->res[0] = theta_hat;
        if (kinds[c->kind[i]].estimate) kinds[c->kind[i]].estimate(k->arg, k->res, k->iw, k->w, 0);
        else memcpy(theta_hat, z, sizeof(double) * c->P);
    }
    if (log->z) memcpy(log->z + row * n * c->Z, y + 2 * n * nv, sizeof(double) * n * c->Z);
}

/* sign of a determinant by elimination with row exchanges; A is destroyed */
static double determinant_sign(double *A, int m) {
    double sign = 1;
    for (int j = 0; j < m; j++) {
        int best = j;
        for (int i = j + 1; i < m; i++)
            if (fabs(A[i * m + j]) > fabs(A[best * m + j])) best = i;
        if (A[best * m + j] == 0) return 0;
        if (best != j) {
            sign = -sign;
            for (int l = 0; l < m; l++) { double t = A[j * m + l]; A[j * m + l] = A[best * m + l]; A[best * m + l] = t; }
        }
        if (A[j * m + j] < 0) sign = -sign;
        for (int i = j + 1; i < m; i++) {
            double f = A[i * m + j] / A[j * m + j];
            for (int l = j; l < m; l++) A[i * m + l] -= f * A[j * m + l];
        }
    }
    return sign;
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

static int turned(const Cell *c, const Work *k, Report *report) {
    int worst = 0;
    double largest = 0;
    for (int i = 0; i < c->n; i++) {
        const double *e = k->task + (size_t)i * 7 * c->m + c->m + 3;
        double angle = kinds[c->kind[i]].pose ? sqrt(e[0] * e[0] + e[1] * e[1] + e[2] * e[2]) : 0;
        if (angle > largest) { largest = angle; worst = i; }
    }
    return largest > c->max_angle && found(report, TURNED, worst, largest);
}

static int singular(const Cell *c, const Work *k, Report *report) {
    for (int i = 0; i < c->n; i++) {
        const Kind *kind = &kinds[c->kind[i]];
        const double *J = k->J + (size_t)i * J_size(c), *J_inv = J + 2 * (size_t)c->m * c->nv;
        double a = 0, b = 0;
        for (int j = 0; j < c->m * kind->nv; j++) { a += J[j] * J[j]; b += J_inv[j] * J_inv[j]; }
        if (kind->cartesian && !(sqrt(a * b) < c->max_condition)) return found(report, SINGULAR, i, sqrt(a * b));
    }
    return 0;
}

static int crossed(const Cell *c, Work *k, Report *report) {
    int m = c->m;
    for (int i = 0; i < c->n; i++) {
        const Kind *kind = &kinds[c->kind[i]];
        if (!kind->cartesian || kind->nv != m) continue;
        memcpy(k->w, k->J + (size_t)i * J_size(c), sizeof(double) * m * m);
        double before = k->sign[i];
        k->sign[i] = determinant_sign(k->w, m);
        if (before != 0 && k->sign[i] != before) return found(report, CROSSED, i, 0);
    }
    return 0;
}

static int check(const Cell *c, const double *y, Work *k, Report *report) {
    if (not_finite(y, state_size(c))) return found(report, STATE, 0, 0);
    if (turned(c, k, report) || singular(c, k, report) || crossed(c, k, report)) return 1;
    for (int i = 0; i < c->n; i++)
        if (not_finite(k->tau + (size_t)i * c->nv, c->nv)) return found(report, TORQUE, i, 0);
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
    int size = c->n * c->nv;
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

static void finish(double *y, double h, double *const *s, int size) {
    for (int j = 0; j < size; j++) y[j] += h / 6 * (s[0][j] + 2 * (s[1][j] + s[2][j]) + s[3][j]);
}

/* Let the robots carry what they carry in a step. */
static void take(const Cell *c, int load, Work *k) { k->pi = c->pi + (size_t)load * c->n * c->bodies; }

/* Advance y through some steps of a block; continuous control. Rows are counted in the report. `window` says which
 * disturbance acts in a step, and `load` what is carried. */
void advance(const Cell *c, const Reference *r, const double *t, const char *marks, const int *window,
             const int *load, const double *disturbances, double *y, Log *log, Work *k, Report *report) {
    int size = state_size(c);
    for (int step = 0; step < r->count; step++) {
        double h = t[step + 1] - t[step];
        const double *d = disturbances + (size_t)window[step] * c->n * c->nv;
        report->step = step;
        take(c, load[step], k);
        evaluate(c, r, 0, step, y, d, k->k[0], k);
        look_back(c, t[step], marks[step] & JOINED ? k->step_error->h : 0, y, k->k[3], k->k[0], k->step_error);
        k->step_error->h = h;
        if (marks[step] & CHECKED && check(c, y, k, report)) return;
        if (marks[step] & LOGGED) record(c, r, step, report->rows++, y, k->tau, d, log, k);
        combine(k->stage, y, 0.5 * h, k->k[0], size);
        evaluate(c, r, 1, step, k->stage, d, k->k[1], k);
        combine(k->stage, y, 0.5 * h, k->k[1], size);
        evaluate(c, r, 1, step, k->stage, d, k->k[2], k);
        combine(k->stage, y, h, k->k[2], size);
        evaluate(c, r, 2, step, k->stage, d, k->k[3], k);
        finish(y, h, k->k, size);
    }
}

/* The same with torque and adaptation held between samples. A logged torque acts from its instant on. */
void advance_sampled(const Cell *c, const Reference *r, const double *t, const char *marks, const int *window, const int *load,
                     const double *disturbances, double *y, Log *log, Work *k, Report *report) {
    int size = state_size(c);
    for (int step = 0; step < r->count; step++) {
        double h = t[step + 1] - t[step];
        const double *d = disturbances + (size_t)window[step] * c->n * c->nv;
        report->step = step;
        take(c, load[step], k);
        if (marks[step] & CHECKED) {
            evaluate(c, r, 0, step, y, d, k->k[0], k);
            if (check(c, y, k, report)) return;
        }
        if (marks[step] & SAMPLED) {
            memcpy(k->held, k->k[0], sizeof(double) * size);
            memcpy(k->held_tau, k->tau, sizeof(double) * c->n * c->nv);
        }
        if (marks[step] & LOGGED) record(c, r, step, report->rows++, y, k->held_tau, d, log, k);
        for (int stage = 0; stage < 4; stage++) {
            double ahead = stage == 0 ? 0 : stage == 3 ? h : 0.5 * h;
            combine(k->stage, y, ahead, k->k[stage ? stage - 1 : 0], size);
            coast(c, stage ? k->stage : y, d, k->k[stage], k);
        }
        finish(y, h, k->k, size);
        coast(c, y, d, k->k[0], k);
        look_back(c, t[step + 1], h, y, k->k[3], k->k[0], k->step_error);
        k->step_error->h_before = 0; /* torque may jump here */
    }
}

/* y' at one instant */
void state_dot(const Cell *c, const Reference *r, const double *y, const double *disturbance, double *y_dot,
               Work *k) {
    take(c, 0, k);
    evaluate(c, r, 0, 0, y, disturbance, y_dot, k);
}

/* The largest scratch arrays that a generated function asks for: arg, res, iw, w. */
void work_sizes(long long *largest) {
    for (int j = 0; j < 4; j++) largest[j] = 0;
    for (int i = 0; i < KINDS; i++)
        for (int f = 0; f < 4 && kinds[i].sizes[f]; f++) {
            long long need[4];
            kinds[i].sizes[f](need, need + 1, need + 2, need + 3);
            for (int j = 0; j < 4; j++)
                if (need[j] > largest[j]) largest[j] = need[j];
        }
}
