/* The tests of the guard of the reference engine, in its order; each looks at all robots before the next one.
 *
 * Where lanes are robots the first that is found ends the run. Where they are runs, each ends by what is found first
 * in it, and the others go on.
 */

/* Lanes that have something that is no number. */
static ivec not_finite(const vec *numbers, int size) {
    vec sum[4] = { splat(0), splat(0), splat(0), splat(0) }; /* which do not wait for each other */
    int j = 0;
    for (; j + 4 <= size; j += 4)
        for (int k = 0; k < 4; k++) sum[k] += numbers[j + k] * splat(0);
    for (; j < size; j++) sum[0] += numbers[j] * splat(0);
    return is_different((sum[0] + sum[1]) + (sum[2] + sum[3]), splat(0));
}

/* Say of lanes what was found there at robot i, unless they have ended before; whether none goes on. */
static int found(const Cell *c, Report *report, ivec lanes, int status, int i, vec value) {
    if (!any(lanes)) return 0;
    vec marked = where(lanes, splat(1));
    for (int l = 0; l < LANES; l++) {
        int run = c->scattered ? 0 : l;
        if (lane(marked, l) == 0 || report->status[run]) continue;
        report->status[run] = status;
        report->at[run] = report->step;
        report->robot[run] = c->scattered ? i * LANES + l : i;
        report->value[run] = lane(value, l);
        report->ended++;
    }
    return report->ended >= (c->scattered ? 1 : LANES);
}

/* Robots of which a watched number has reached its bound, or is none; number by number. */
static int beyond(const Cell *c, const Quantities *a, Report *report) {
    for (int k = 0; k < watches; k++)
        for (int i = 0; i < c->n; i++) {
            vec value = a->watched[i * watches + k];
            ivec within = is_less(value, a->bounds[k]);
            if (found(c, report, ~within, FOUND_STATE + 1 + k, i, value)) return 1;
        }
    return 0;
}

/* Robots on the other side of a singular configuration than at the last checked instant. */
static int crossed(const Cell *c, const Quantities *a, Work *k, Report *report) {
    vec zero = splat(0);
    int end = 0;
    for (int i = 0; watches && i < c->n; i++) {
        vec side = a->side[i], before = k->side[i];
        ivec there = is_less(side, zero) & is_less(zero, before), back = is_less(zero, side) & is_less(before, zero);
        k->side[i] = side;
        end |= found(c, report, there | back, FOUND_SIDE, i, zero);
    }
    return end;
}

/* Whether the run, or every one of the runs, ends here. */
static int check(const Cell *c, const Quantities *a, Work *k, const vec *y, Report *report) {
    if (found(c, report, not_finite(y, state_size(c)), FOUND_STATE, 0, splat(0))) {
        if (c->scattered) report->robot[0] = 0;
        return 1;
    }
    for (int i = 0; watches && i < c->n; i++) call_guard(c, a, i);
    if (beyond(c, a, report) || crossed(c, a, k, report)) return 1;
    for (int i = 0; i < c->n; i++)
        if (found(c, report, not_finite(a->tau + (size_t)i * nv, nv), FOUND_TORQUE, i, splat(0))) return 1;
    return 0;
}

/* Keep an error of a step, in lanes where it is larger than those before. */
static void note(StepError *worst, vec error, double t, int joint) {
    ivec larger = is_less(worst->largest[0], error) & is_less(error, splat(INFINITY));
    worst->largest[0] = choose(larger, error, worst->largest[0]);
    worst->time[0] = choose(larger, splat(t), worst->time[0]);
    worst->at[0] = choose(larger, splat(joint), worst->at[0]);
}

/* The step that ended at t, as `StepError` of step_error.py judges it: by the derivatives k4 and k1 on both sides
 * of t, and by Simpson's rule over two steps. h = 0 where it cannot be judged. */
static void look_back(const Cell *c, double t, double h, const vec *y, const vec *k4, const vec *k1, StepError *w) {
    int size = c->n * nv;
    int equal = h > 0 && fabs(h - w->h_before) <= 1e-6 * h;
    for (int j = 0; j < size; j++) {
        vec v = y[size + j], a = k1[size + j], *vs = w->v + j, *as = w->a + j, fast = v_fabs(v);
        ivec faster = is_less(w->speed[0], fast) & is_less(fast, splat(INFINITY));
        w->speed[0] = choose(faster, fast, w->speed[0]);
        note(w, splat(h / 6) * v_fabs(k4[size + j] - a), t, j);
        if (equal) note(w, v_fabs(v - vs[0] - splat(h / 3) * (as[0] + splat(4) * as[size] + a)), t, j);
        vs[0] = vs[size];
        vs[size] = v;
        as[0] = as[size];
        as[size] = a;
    }
    w->h_before = h;
}
