// Numbers that every concept may use.

const float PI = 3.14159265358979323846;
const float INV_PI = 0.31830988618379067154;
const float INV_4PI = 0.07957747154594766788;
const float INV_SQRT_PI = 0.56418958354775628695;
const uint NONE = 0xffffffffu;
