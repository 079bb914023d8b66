/* SPDX-License-Identifier: MIT */
/* x' = A x + b u(t) by CVODE (BDF, dense Jacobian), u linear between samples; STATES states, SPEEDS kept. */
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <string.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>

struct problem {
    const double *A, *b, *u;
    double h;
    int count;
};

static int rates(realtype t, N_Vector y, N_Vector out, void *user)
{
    struct problem *p = user;
    double *x = NV_DATA_S(y), *dx = NV_DATA_S(out);
    int k = (int)(t / p->h);
    k = k < 0 ? 0 : k > p->count - 2 ? p->count - 2 : k;
    double input = p->u[k] + (t / p->h - k) * (p->u[k + 1] - p->u[k]);
    for (int i = 0; i < STATES; i++) {
        double sum = p->b[i] * input;
        for (int j = 0; j < STATES; j++)
            sum += p->A[i * STATES + j] * x[j];
        dx[i] = sum;
    }
    return 0;
}

static int jacobian(realtype t, N_Vector y, N_Vector f, SUNMatrix out, void *user, N_Vector a,
                    N_Vector b, N_Vector c)
{
    struct problem *p = user;
    for (int i = 0; i < STATES; i++)
        for (int j = 0; j < STATES; j++)
            SM_ELEMENT_D(out, i, j) = p->A[i * STATES + j];
    return 0;
}

int solve(const double *A, const double *b, const double *u, double h, int count, double tolerance,
          double *out)
{
    struct problem p = {A, b, u, h, count};
    SUNContext context;
    SUNContext_Create(NULL, &context);
    N_Vector y = N_VNew_Serial(STATES, context);
    N_VConst(0.0, y);
    SUNMatrix matrix = SUNDenseMatrix(STATES, STATES, context);
    SUNLinearSolver solver = SUNLinSol_Dense(y, matrix, context);
    void *memory = CVodeCreate(CV_BDF, context);
    CVodeInit(memory, rates, 0.0, y);
    CVodeSStolerances(memory, tolerance, tolerance);
    CVodeSetUserData(memory, &p);
    CVodeSetLinearSolver(memory, solver, matrix);
    CVodeSetJacFn(memory, jacobian);
    CVodeSetMaxNumSteps(memory, 1000000);
    double t = 0.0;
    int status = 0;
    memset(out, 0, sizeof(double) * SPEEDS);
    for (int k = 1; k < count && status >= 0; k++) {
        status = CVode(memory, k * h, y, &t, CV_NORMAL);
        memcpy(out + k * SPEEDS, NV_DATA_S(y), sizeof(double) * SPEEDS);
    }
    CVodeFree(&memory);
    SUNLinSolFree(solver);
    SUNMatDestroy(matrix);
    N_VDestroy(y);
    SUNContext_Free(&context);
    return status;
}
