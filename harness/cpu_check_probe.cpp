// A program with nothing but the check of the CPU: a test starts it on an emulated old one.
int main() { return 0; }
