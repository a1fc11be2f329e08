/* A ray tracer that reads notabug's scene.json and writes a PFM: cc -O2 tiny.c -o tiny -lm; ./tiny scene.json out.pfm */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
typedef struct { double p[3][3], n[3][3], uv[3][2]; int material, smooth; } Triangle;
static char *text; static Triangle *tri; static int count;
static double dot(const double *a, const double *b) { return a[0]*b[0] + a[1]*b[1] + a[2]*b[2]; }
static void cross(const double *a, const double *b, double *c) {
    for (int i = 0; i < 3; i++) c[i] = a[(i+1)%3]*b[(i+2)%3] - a[(i+2)%3]*b[(i+1)%3]; }
/* The value of a key after `from` and before `end`, or NULL; and all numbers of that value, brackets ignored. */
static char *find(char *from, char *end, const char *key) {
    char word[64]; snprintf(word, 64, "\"%s\": ", key);
    char *at = strstr(from, word); return at && at < end ? at + strlen(word) : NULL; }
static double *numbers(char *at) {
    int room = 16, n = 0, depth = 0; double *v = malloc(room * sizeof *v);
    do { if (*at == '[') depth++, at++; else if (*at == ']') depth--, at++; else if (*at == ',' || *at == ' ') at++;
         else { if (n == room) v = realloc(v, (room *= 2) * sizeof *v); v[n++] = strtod(at, &at); } } while (depth);
    return v; }
static char *close_of(char *at) { int d = 0; do d += (*at == '{' || *at == '[') - (*at == '}' || *at == ']'); while (at++, d); return at; }
/* The nearest triangle along O + tD beyond t = eps (Moller and Trumbore 1997), or -1; its barycentric u, v. */
static int hit(const double *O, const double *D, double far, double *t, double *u, double *v) {
    int best = -1; *t = far;
    for (int k = 0; k < count; k++) {
        double a[3], b[3], s[3], p[3], q[3];
        for (int i = 0; i < 3; i++) a[i] = tri[k].p[1][i]-tri[k].p[0][i], b[i] = tri[k].p[2][i]-tri[k].p[0][i], s[i] = O[i]-tri[k].p[0][i];
        cross(D, b, p); double det = dot(a, p); if (det == 0) continue;
        cross(s, a, q); double x = dot(s, p)/det, y = dot(D, q)/det, d = dot(b, q)/det;
        if (x >= 0 && y >= 0 && x + y <= 1 && d > 1e-6 && d < *t) best = k, *t = d, *u = x, *v = y; }
    return best; }
int main(int argc, char **argv) {
    if (argc < 3) return 2;
    FILE *f = fopen(argv[1], "rb"); if (!f) return 1;
    fseek(f, 0, SEEK_END); long size = ftell(f); rewind(f); text = calloc(size + 1, 1); if (fread(text, 1, size, f) != (size_t)size) return 1;
    char *end = text + size, *cam = find(text, end, "camera"), *mats = find(text, end, "materials"), *lights = find(text, end, "lights");
    int W = atoi(find(text, end, "width")), H = atoi(find(text, end, "height"));
    double *eye = numbers(find(cam, end, "position")), *X = numbers(find(cam, end, "right")), *Y = numbers(find(cam, end, "up")), *Z = numbers(find(cam, end, "back"));
    double tx = atof(find(cam, end, "tan_x")), ty = atof(find(cam, end, "tan_y"));
    for (char *o = strchr(find(text, end, "objects"), '{'); o; o = strchr(close_of(o), '{')) {
        char *e = close_of(o), *n = find(o, e, "normals"), *st = find(o, e, "uv"), *list = find(o, e, "triangles");
        double *P = numbers(find(o, e, "points")), *N = n ? numbers(n) : NULL, *T = st ? numbers(st) : NULL, *C = numbers(find(o, e, "corners")), *L = numbers(list);
        int m = 0; for (char *c = list; c < close_of(list); c++) m += *c == '['; /* one bracket more than triangles */
        tri = realloc(tri, (count + m) * sizeof *tri);
        for (int k = 0; k < m - 1; k++) { Triangle *t = &tri[count++]; t->material = atoi(find(o, e, "material")); t->smooth = N != NULL;
            for (int j = 0; j < 3; j++) { int c = (int)L[3*k+j];
                for (int i = 0; i < 3; i++) t->p[j][i] = P[3*(int)C[c]+i], t->n[j][i] = N ? N[3*c+i] : 0;
                for (int i = 0; i < 2; i++) t->uv[j][i] = T ? T[2*c+i] : 0; } } }
    FILE *out = fopen(argv[2], "wb"); if (!out) return 1; fprintf(out, "PF\n%d %d\n-1.0\n", W, H);
    for (int y = H - 1; y >= 0; y--) for (int x = 0; x < W; x++) {
        double a = (2*(x+.5)/W - 1)*tx, b = (1 - 2*(y+.5)/H)*ty, D[3], p[3], N[3], t, u, v; float rgb[3] = {0, 0, 0};
        for (int i = 0; i < 3; i++) D[i] = a*X[i] + b*Y[i] - Z[i];
        int k = hit(eye, D, 1e30, &t, &u, &v);
        if (k >= 0) { Triangle *T = &tri[k]; double w = 1-u-v, e1[3], e2[3], colour[3];
            for (int i = 0; i < 3; i++) p[i] = eye[i] + t*D[i], N[i] = w*T->n[0][i] + u*T->n[1][i] + v*T->n[2][i], e1[i] = T->p[1][i]-T->p[0][i], e2[i] = T->p[2][i]-T->p[0][i];
            if (!T->smooth) cross(e1, e2, N);
            double s = (dot(N, D) > 0 ? -1 : 1)/sqrt(dot(N, N)); for (int i = 0; i < 3; i++) N[i] *= s;
            char *m = strchr(mats, '{'); for (int i = 0; i < T->material; i++) m = strchr(close_of(m), '{');
            memcpy(colour, numbers(find(m, end, "diffuse")), sizeof colour);
            for (char *l = strchr(lights, '{'); l && l < mats; l = strchr(close_of(l), '{')) {
                char *e = close_of(l), *at = find(l, e, "position"); double L[3], far = 1e30, scale = 1, tt, uu, vv, *power = numbers(find(l, e, at ? "intensity" : "irradiance"));
                double *where = numbers(at ? at : find(l, e, "direction"));
                for (int i = 0; i < 3; i++) L[i] = at ? where[i] - p[i] : -where[i];
                double d = sqrt(dot(L, L)); for (int i = 0; i < 3; i++) L[i] /= d;
                if (at) far = d, scale = 1/(d*d);
                double lit = dot(N, L); if (lit <= 0 || hit(p, L, far, &tt, &uu, &vv) >= 0) continue;
                for (int i = 0; i < 3; i++) rgb[i] += colour[i]*power[i]*scale*lit/M_PI; } }
        fwrite(rgb, 4, 3, out); }
    return fclose(out); }
