/* From step to step: samples, the method of Runge and Kutta, and what is looked at and kept on the way. */

/* One step of the classical Runge-Kutta method from y, whose first slope is at hand. */
static void runge_kutta(const Cell *c, Quantities *a, Work *k, const Steps *s, Rate *rate, int step, double h, vec *y) {
    static const int stages[] = { 0, 1, 1, 2 };
    vec *const *slope = k->k;
    double *at = (double *)y, *const *rate_of = (double *const *)k->k;
    long size = state_size(c) * LANES;
    for (int i = 1; i < 4; i++) {
        combine((double *)k->stage, at, i < 3 ? 0.5 * h : h, rate_of[i - 1], size);
        rate(c, a, k, s, stages[i], step, k->stage, slope[i]);
    }
    conclude(at, h / 6, rate_of[0], rate_of[1], rate_of[2], rate_of[3], size);
}

/* Let adaptations make of their state what they do after a step or a sample, before anything is asked about it. */
static void settle(const Cell *c, Quantities *a, Work *k, vec *y) {
    place(c, a, y, k->k[0]);
    for (int i = 0; i < c->n; i++) {
        const vec *z = NULL;
        if (kinds[c->kind[i]].leap && lane(a->since[0], 0) > 0) {
            call_leap(c, a, i);
            z = a->leapt;
        } else if (kinds[c->kind[i]].settle) {
            call_settle(c, a, i);
            z = a->settled;
        }
        if (z) memcpy(a->z + (size_t)i * Z, z + (size_t)i * Z, sizeof(vec) * Z);
    }
}

/* All that happens at the start of a step, before time goes on; whether the run ends here. With continuous control
 * every step begins with a sample. */
static int begin(const Cell *c, Quantities *a, Work *k, const Steps *s, int step, vec *y, const Log *log,
                 Report *report) {
    int marks = s->marks[step], senses = marks & SAMPLED && s->sense;
    report->step = step;
    take(a, s, step);
    if (marks & SAMPLED) settle(c, a, k, y);
    if (senses && perceive(c, a, k, s, step, y)) return 1;
    if (marks & (CHECKED | SAMPLED)) evaluate(c, a, k, s, 0, step, y, k->k[0]);
    if (senses) memcpy(a->tau, a->acting, sizeof(vec) * c->n * nv);
    if (!s->holds)
        look_back(c, s->t[step], marks & JOINED ? k->step_error.h : 0, y, k->k[3], k->k[0], &k->step_error);
    if (marks & CHECKED && check(c, a, k, y, report)) return 1;
    if (marks & SAMPLED && !senses) sample(c, a, k, s);
    if (s->act && actuate(c, a, s, step)) return 1;
    if (!(marks & LOGGED)) return 0;
    if (s->tally) tally(c, a, s->t[step], s->tally);
    else { know(c, a); record(c, a, report->rows, log); }
    report->rows++;
    return 0;
}

/* Look at a step that has ended, by what the torque that was held through it does there: it may jump now. */
static void look_at_end(const Cell *c, Quantities *a, Work *k, const Steps *s, int step, double h, const vec *y) {
    coast(c, a, k, s, 2, step, y, k->k[0]);
    look_back(c, s->t[step + 1], h, y, k->k[3], k->k[0], &k->step_error);
    k->step_error.h_before = 0;
}

/* Advance y through some steps; rows are counted in the report. */
void advance(const Cell *c, Quantities *a, Work *k, const Steps *s, vec *y, const Log *log, Report *report) {
    Rate *rate = s->holds ? coast : evaluate;
    a->hidden = y + controlled(c) + c->n * Z + c->r;
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
void state_dot(const Cell *c, Quantities *a, Work *k, const Steps *s, const vec *y, vec *y_dot) {
    take(a, s, 0);
    evaluate(c, a, k, s, 0, 0, y, y_dot);
}

/* How many lanes there are. */
int lanes(void) { return LANES; }
