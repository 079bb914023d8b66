/* SPDX-License-Identifier: MIT */
/* x(t + h) = E x + a u + b u' with precomputed E, a, b: N states, of which the first SPEEDS are kept. */
#include <string.h>
#define WIDTH ((N + 7) / 8 * 8)

void march(const double *E, const double *a, const double *b, const double *u, double h, int count,
           double *out)
{
    double columns[N][WIDTH] = {{0}}, held[WIDTH] = {0}, rising[WIDTH] = {0}, x[WIDTH] = {0};
    for (int j = 0; j < N; j++)
        for (int i = 0; i < N; i++)
            columns[j][i] = E[i * N + j];
    memcpy(held, a, sizeof(double) * N);
    memcpy(rising, b, sizeof(double) * N);
    memset(out, 0, sizeof(double) * SPEEDS);
    for (int k = 0; k + 1 < count; k++) {
        double slope = (u[k + 1] - u[k]) / h, next[WIDTH];
        for (int i = 0; i < WIDTH; i++)
            next[i] = held[i] * u[k] + rising[i] * slope;
        for (int j = 0; j < N; j++)
            for (int i = 0; i < WIDTH; i++)
                next[i] += columns[j][i] * x[j];
        memcpy(x, next, sizeof x);
        memcpy(out + (k + 1) * SPEEDS, x, sizeof(double) * SPEEDS);
    }
}
